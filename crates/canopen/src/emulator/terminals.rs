// SPDX-License-Identifier: Apache-2.0
//! The inputs and outputs of an emulated CiA 401 module.
use super::said::Terminals;
use cia402::Entry;
use cia402::emulated::{Access, Handle, Objects};

/// Terminals that a module controls.
#[derive(Default)]
pub(super) struct SwitchedTerminals {
    outputs: Vec<Output>,
    pub error: u16,
}

/// An output object, and its value if the controller is lost.
struct Output {
    at: Handle,
    /// Mask of the bits that have an error value; for an analog output, whether it has one.
    mode: Handle,
    value: Handle,
    is_digital: bool,
}

/// Objects of the digital and analog terminals.
const INPUTS: u16 = 0x6000;
const OUTPUTS: u16 = 0x6200;
const ANALOG_INPUTS: u16 = 0x6401;
const ANALOG_OUTPUTS: u16 = 0x6411;

impl SwitchedTerminals {
    /// Adds the objects of the terminals to the existing ones.
    pub fn new(objects: &mut Objects, of: Terminals) -> SwitchedTerminals {
        let mut switched = SwitchedTerminals::default();
        let bytes = |terminals: u8| terminals.div_ceil(8);
        add(objects, INPUTS, bytes(of.inputs), Access::Measured, &[0]);
        let values = add(objects, OUTPUTS, bytes(of.outputs), Access::Written, &[0]);
        let modes = add(objects, 0x6206, bytes(of.outputs), Access::Written, &[0xFF]);
        let safe = add(objects, 0x6207, bytes(of.outputs), Access::Written, &[0]);
        switched.take(&values, &modes, &safe, true);
        add(objects, ANALOG_INPUTS, of.analog_inputs, Access::Measured, &[0; 2]);
        let values = add(objects, ANALOG_OUTPUTS, of.analog_outputs, Access::Written, &[0; 2]);
        let modes = add(objects, 0x6443, of.analog_outputs, Access::Written, &[1]);
        let error_value: &[u8] = if of.short_error_values { &[0; 2] } else { &[0; 4] };
        let safe = add(objects, 0x6444, of.analog_outputs, Access::Written, error_value);
        switched.take(&values, &modes, &safe, false);
        switched
    }

    fn take(&mut self, values: &[Handle], modes: &[Handle], safe: &[Handle], is_digital: bool) {
        let all = values.iter().zip(modes).zip(safe);
        self.outputs.extend(all.map(|((at, mode), value)| Output { at: *at, mode: *mode, value: *value, is_digital }));
    }

    /// Sets each output that has an error value to this value.
    pub fn be_safe(&self, objects: &mut Objects) {
        for output in &self.outputs {
            let (now, mode, value) = (objects.number(output.at), objects.number(output.mode), objects.number(output.value));
            let safe = match (output.is_digital, mode) {
                (true, _) => now & !mode | value & mode,
                (false, 0) => now,
                (false, _) => value,
            };
            objects.set_number(output.at, safe);
        }
    }
}

fn add(objects: &mut Objects, index: u16, count: u8, access: Access, value: &[u8]) -> Vec<Handle> {
    if count > 0 {
        objects.add(index, 0, Access::Constant, &[count]);
    }
    (1..=count).map(|sub| objects.add(index, sub, access, value)).collect()
}

/// Returns the location of a terminal: its object, and its bit if it is digital. `what` is `input`, `output`, `analog_input` or
/// `analog_output`.
pub(super) fn terminal(what: &str, number: u8) -> Option<(Entry, Option<u8>)> {
    let digital = |index| Some((Entry { index, sub: number / 8 + 1 }, Some(number % 8)));
    let analog = |index| Some((Entry { index, sub: number.checked_add(1)? }, None));
    match what {
        "input" => digital(INPUTS),
        "output" => digital(OUTPUTS),
        "analog_input" => analog(ANALOG_INPUTS),
        "analog_output" => analog(ANALOG_OUTPUTS),
        _ => None,
    }
}
