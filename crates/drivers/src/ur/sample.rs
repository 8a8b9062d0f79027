// SPDX-License-Identifier: Apache-2.0
//! Readings of a controller in each cycle, and inputs to it.
use super::rtde::{self, Fields};

/// Number of joints of a controller's arm.
pub(super) const JOINTS: usize = 6;

/// Requested outputs: name, type. [`Sample::decode`] reads them in this order.
pub(super) const OUTPUTS: [(&str, &str); 13] = [
    ("timestamp", "DOUBLE"),
    ("actual_q", "VECTOR6D"),
    ("actual_qd", "VECTOR6D"),
    ("actual_TCP_force", "VECTOR6D"),
    ("robot_mode", "INT32"),
    ("safety_status", "INT32"),
    ("runtime_state", "UINT32"),
    ("speed_scaling", "DOUBLE"),
    ("actual_digital_input_bits", "UINT64"),
    ("actual_digital_output_bits", "UINT64"),
    ("standard_analog_input0", "DOUBLE"),
    ("standard_analog_input1", "DOUBLE"),
    ("output_int_register_24", "INT32"),
];
const VALUES_LEN: usize = 8 + 3 * 48 + 3 * 4 + 8 + 2 * 8 + 2 * 8 + 4;

/// Inputs sent to the controller. The upper half of the registers is for external programs, the lower half for fieldbuses.
pub(super) const INPUTS: [(&str, &str); 10] = [
    ("input_int_register_24", "INT32"),
    ("input_int_register_25", "INT32"),
    ("input_double_register_24", "DOUBLE"),
    ("input_double_register_25", "DOUBLE"),
    ("input_double_register_26", "DOUBLE"),
    ("input_double_register_27", "DOUBLE"),
    ("input_double_register_28", "DOUBLE"),
    ("input_double_register_29", "DOUBLE"),
    ("standard_digital_output_mask", "UINT8"),
    ("standard_digital_output", "UINT8"),
];
pub(super) const PACKAGE_LEN: usize = 3 + 1 + 2 * 4 + JOINTS * 8 + 2;

/// Readings of one cycle of a controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sample {
    /// Time since the start of the controller, s.
    pub timestamp: f64,
    pub position: [f64; JOINTS],
    pub velocity: [f64; JOINTS],
    /// Force and torque at the tool, in the frame of the base.
    pub force: [f64; 6],
    pub robot_mode: i32,
    pub safety: i32,
    pub runtime: u32,
    pub speed_scaling: f64,
    pub inputs: u64,
    pub outputs: u64,
    pub analog: [f64; 2],
    /// State reported by the script.
    pub script: i32,
}

impl Sample {
    /// Decodes a data package; returns `None` if its length is wrong, or a number is not finite.
    pub fn decode(values: &[u8]) -> Option<Sample> {
        if values.len() != VALUES_LEN {
            return None;
        }
        let mut fields = Fields(values);
        let sample = Sample {
            timestamp: fields.double(),
            position: fields.doubles(),
            velocity: fields.doubles(),
            force: fields.doubles(),
            robot_mode: fields.i32(),
            safety: fields.i32(),
            runtime: fields.u32(),
            speed_scaling: fields.double(),
            inputs: fields.u64(),
            outputs: fields.u64(),
            analog: fields.doubles(),
            script: fields.i32(),
        };
        let moves = [sample.timestamp].into_iter().chain(sample.position).chain(sample.velocity).chain(sample.force);
        moves.chain(sample.analog).chain([sample.speed_scaling]).all(f64::is_finite).then_some(sample)
    }
}

/// Inputs of the script in each cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ScriptInputs {
    /// Heartbeat counter, incremented in every package; the script interprets a constant value as a lost connection.
    pub beat: i32,
    /// Mode of the script: its own session number to follow the goals, 0 to rest, -1 to end.
    pub mode: i32,
    pub goals: [f64; JOINTS],
    /// Commanded digital outputs, and their values.
    pub mask: u8,
    pub levels: u8,
}

impl ScriptInputs {
    /// Encodes the data package with the recipe ID assigned by the controller.
    pub fn encode(&self, recipe: u8) -> [u8; PACKAGE_LEN] {
        let mut package = [0; PACKAGE_LEN];
        let mut at = 0;
        let mut put = |bytes: &[u8]| {
            package[at..at + bytes.len()].copy_from_slice(bytes);
            at += bytes.len();
        };
        put(&(PACKAGE_LEN as u16).to_be_bytes());
        put(&[rtde::kind::DATA, recipe]);
        put(&self.beat.to_be_bytes());
        put(&self.mode.to_be_bytes());
        for goal in self.goals {
            put(&goal.to_be_bytes());
        }
        put(&[self.mask, self.levels]);
        package
    }
}

/// Returns the names of a recipe in the format of the request, and the types that the answer must contain.
pub(super) fn recipe(of: &[(&str, &str)]) -> (String, String) {
    let list = |pick: fn(&(&str, &str)) -> String| of.iter().map(pick).collect::<Vec<_>>().join(",");
    (list(|(name, _)| (*name).to_owned()), list(|(_, kind)| (*kind).to_owned()))
}

#[cfg(test)]
mod tests {
    use super::super::rtde::{Message, decode};
    use super::*;
    use proptest::prelude::*;

    fn len_of(kind: &str) -> usize {
        match kind {
            "DOUBLE" | "UINT64" => 8,
            "VECTOR6D" => 48,
            "INT32" | "UINT32" => 4,
            _ => 1,
        }
    }

    #[test]
    fn the_lengths_are_those_of_the_recipes() {
        assert_eq!(OUTPUTS.iter().map(|(_, kind)| len_of(kind)).sum::<usize>(), VALUES_LEN);
        assert_eq!(INPUTS.iter().map(|(_, kind)| len_of(kind)).sum::<usize>() + 4, PACKAGE_LEN);
    }

    #[test]
    fn what_it_is_told_lies_in_the_order_of_the_recipe() {
        let package = ScriptInputs { beat: 1, mode: 7, goals: [0.5, 0.0, 0.0, 0.0, 0.0, -2.0], mask: 3, levels: 1 }.encode(4);
        let Ok(Some((Message::Data { recipe: 4, values }, PACKAGE_LEN))) = decode(&package) else { panic!("no data package") };
        let mut fields = Fields(values);
        assert_eq!((fields.i32(), fields.i32(), fields.doubles::<JOINTS>()), (1, 7, [0.5, 0.0, 0.0, 0.0, 0.0, -2.0]));
        assert_eq!(fields.0, [3, 1]);
    }

    proptest! {
        #[test]
        fn a_sample_is_of_one_length_and_of_numbers(bytes in proptest::collection::vec(any::<u8>(), VALUES_LEN - 2..VALUES_LEN + 3)) {
            if let Some(sample) = Sample::decode(&bytes) {
                prop_assert_eq!(bytes.len(), VALUES_LEN);
                prop_assert!(sample.position.iter().chain(&sample.velocity).all(|of| of.is_finite()));
            }
        }
    }
}
