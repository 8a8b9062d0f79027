// SPDX-License-Identifier: Apache-2.0
//! Driving outputs: quantities that keep a machine moving although nothing new is commanded, such as an effort, a speed or a power.
//!
//! A constant position keeps the machine where it is; so does a constant temperature, pressure or switch state. A constant torque
//! accelerates its load. A driving output therefore has an idle value, which it takes when the verb that writes it is suspended: the safe
//! value of a channel, or 0 for an SVV that commands a device. An output whose initial value is not 0 is a limit and keeps its value.

/// Driving quantities, each with a unit.
const DRIVING: [(&str, &str); 15] = [
    ("force", "N"),
    ("torque", "N.m"),
    ("speed", "m/s"),
    ("angular speed", "rad/s"),
    ("acceleration", "m/s^2"),
    ("angular acceleration", "rad/s^2"),
    ("jerk", "m/s^3"),
    ("angular jerk", "rad/s^3"),
    ("power", "W"),
    ("current", "A"),
    ("voltage", "V"),
    ("flow", "m^3/s"),
    ("mass flow", "kg/s"),
    ("rate", "Hz"),
    ("rate of counts", "counts/s"),
];

/// Returns the driving quantity that a unit measures, such as `torque` for `kN.m`; `None` if it is not a driving quantity. If the unit
/// has alternatives, `N.m|N`, the first one counts.
pub fn driving(unit: &str) -> Option<&'static str> {
    let kinds = || unit.split('|').filter(|unit| !unit.is_empty());
    kinds().find_map(|unit| DRIVING.iter().find(|(_, of)| crate::quantity::is_same_kind(unit, of)).map(|(quantity, _)| *quantity))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_a_unit_that_is_known_and_of_a_kind_of_its_own() {
        for (index, (quantity, unit)) in DRIVING.iter().enumerate() {
            assert_eq!(driving(unit), Some(*quantity), "row {index}");
        }
    }

    #[test]
    fn efforts_speeds_and_powers_drive_on_and_positions_and_levels_stay() {
        for unit in ["N", "kN", "N.m", "N.m|N", "m/s", "mm/s", "rad/s", "deg/s", "rpm", "rad/s^2", "m/s^3", "W", "kW", "A", "mA", "V", "l/min", "Hz"] {
            assert!(driving(unit).is_some(), "{unit}");
        }
        for unit in ["", "rad", "m", "mm", "deg", "rad|m", "K", "Pa", "bar", "%", "1", "kg", "s", "counts", "N/m", "N.m/rad", "N.m.s/rad"] {
            assert_eq!(driving(unit), None, "{unit}");
        }
    }
}
