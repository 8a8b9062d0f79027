// SPDX-License-Identifier: Apache-2.0
//! Compares the identity of a device on a bus with the options, and with the device that was first found at that address.
//!
//! Cables and node numbers get mixed up. No later check would notice that commands for an axis named 'gripper' reach the spindle, so
//! devices are identified before they are configured.
use std::collections::HashMap;
use std::fmt;
use std::sync::{Mutex, PoisonError};

/// Identity reported by a device; numbers that it does not report are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    pub vendor: u32,
    pub product: u32,
    pub revision: u32,
    pub serial: u32,
    /// EtherCAT station alias.
    pub alias: u16,
}

/// Identity that the options require; omitted numbers are not compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExpectedIdentity {
    pub vendor: Option<u32>,
    pub product: Option<u32>,
    pub revision: Option<u32>,
    pub serial: Option<u32>,
    pub alias: Option<u16>,
}

/// Identities found when a bus was first opened, by location on the bus. They outlive the driver, because a reset creates a new driver.
static FIRST: Mutex<Option<HashMap<String, Identity>>> = Mutex::new(None);

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "vendor {:#010x}, product {:#010x}, revision {:#010x}, serial {}", self.vendor, self.product, self.revision, self.serial)?;
        if self.alias == 0 { Ok(()) } else { write!(f, ", alias {}", self.alias) }
    }
}

impl ExpectedIdentity {
    /// Returns the first number that differs from `found`, as (option, expected value, found value).
    fn difference(&self, found: &Identity) -> Option<(&'static str, u32, u32)> {
        let compared = [
            ("vendor", self.vendor, found.vendor),
            ("product", self.product, found.product),
            ("revision", self.revision, found.revision),
            ("serial", self.serial, found.serial),
            ("alias", self.alias.map(u32::from), u32::from(found.alias)),
        ];
        compared.into_iter().find_map(|(option, asked, found)| Some((option, asked.filter(|asked| *asked != found)?, found)))
    }
}

/// A device on a bus that is being opened.
#[derive(Clone, Debug)]
pub struct BusDevice {
    /// Name used in errors: `axis 'gripper' at place 1`.
    pub title: String,
    /// Key of the device's location, for the next time the bus is opened: bus, position or node, name of the axis.
    pub place: String,
    pub expected: ExpectedIdentity,
    pub found: Identity,
}

/// Compares the devices of a bus with the options and with those found when the bus was first opened. If all match, stores the identities
/// of the new ones.
///
/// # Errors
/// Fails with a message that names the first mismatching device, and the current location of the expected one.
pub fn check(devices: &[BusDevice]) -> Result<(), String> {
    let mut first = FIRST.lock().unwrap_or_else(PoisonError::into_inner);
    let first = first.get_or_insert_default();
    for device in devices {
        let (title, found) = (&device.title, &device.found);
        if let Some((option, asked, is)) = device.expected.difference(found) {
            let holds = |other: &&BusDevice| other.place != device.place && device.expected.difference(&other.found).is_none();
            let elsewhere = told(devices.iter().find(holds));
            return Err(format!("{title} does not match its options: its {option} is {is} ({is:#x}), not {asked} ({asked:#x}){elsewhere}"));
        }
        // A serial number in the options determines the device, whatever was there before.
        let Some(before) = first.get(&device.place).filter(|before| *before != found && device.expected.serial.is_none()) else { continue };
        let elsewhere = told(devices.iter().find(|other| other.place != device.place && other.found == *before));
        return Err(format!(
            "{title} is a different device than when it was first opened: it is {found}, and was {before}{elsewhere}; connect the devices as they \
             were, or, if it was replaced on purpose, give its option serial ({}) or restart the program",
            found.serial
        ));
    }
    first.extend(devices.iter().map(|device| (device.place.clone(), device.found)));
    Ok(())
}

fn told(elsewhere: Option<&BusDevice>) -> String {
    elsewhere.map_or_else(String::new, |other| format!("; the right one is connected as {}: the two are swapped", other.title))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opened(bus: &str, name: &str, serial: u32) -> BusDevice {
        let found = Identity { vendor: 1, product: 2, revision: 3, serial, alias: 0 };
        BusDevice { title: format!("axis '{name}'"), place: format!("{bus} {name}"), expected: ExpectedIdentity::default(), found }
    }

    #[test]
    fn swapped_devices_are_named_and_a_replaced_one_is_taken_by_its_serial_number() {
        let of = |gripper, spindle| [opened("swap", "gripper", gripper), opened("swap", "spindle", spindle)];
        check(&of(7, 8)).expect("the first opening");
        check(&of(7, 8)).expect("as before");
        let swapped = check(&of(8, 7)).expect_err("swapped");
        assert!(swapped.starts_with("axis 'gripper' is a different device than when it was first opened: it is vendor"), "{swapped}");
        assert!(swapped.contains("serial 8, and was") && swapped.contains("connected as axis 'spindle': the two are swapped"), "{swapped}");
        let replaced = check(&of(7, 9)).expect_err("another one");
        assert!(replaced.contains("axis 'spindle'") && replaced.contains("give its option serial (9)"), "{replaced}");
        let mut asked = of(7, 9);
        asked[1].expected.serial = Some(9);
        check(&asked).expect("replaced on purpose");
        check(&of(7, 9)).expect("remembered");
    }

    #[test]
    fn each_number_of_the_options_is_compared() {
        let found = Identity { vendor: 1, product: 2, revision: 3, serial: 4, alias: 5 };
        let right = ExpectedIdentity { vendor: Some(1), product: Some(2), revision: Some(3), serial: Some(4), alias: Some(5) };
        assert_eq!(right.difference(&found), None);
        assert_eq!(ExpectedIdentity::default().difference(&found), None);
        for (wrong, option) in [
            (ExpectedIdentity { vendor: Some(9), ..right }, "vendor"),
            (ExpectedIdentity { product: Some(9), ..right }, "product"),
            (ExpectedIdentity { revision: Some(9), ..right }, "revision"),
            (ExpectedIdentity { serial: Some(9), ..right }, "serial"),
            (ExpectedIdentity { alias: Some(9), ..right }, "alias"),
        ] {
            assert_eq!(wrong.difference(&found).map(|(option, asked, _)| (option, asked)), Some((option, 9)));
        }
        let mut devices = [opened("asked", "x", 1), opened("asked", "y", 2)];
        devices[0].expected.serial = Some(2);
        let refused = check(&devices).expect_err("swapped");
        assert!(refused.contains("its serial is 1 (0x1), not 2 (0x2); the right one is connected as axis 'y'"), "{refused}");
    }
}
