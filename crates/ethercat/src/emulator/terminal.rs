// SPDX-License-Identifier: Apache-2.0
//! An emulated input and output terminal: a digital one without a mailbox, or an analog one with objects.
use super::options::TerminalOptions;
use crate::coe::Entry;
use crate::sii::{Pdo, PdoEntry, SyncManager};
use cia402::emulated::{Access, Objects};

/// CoE data types.
const BOOL: u8 = 1;
const INTEGER16: u8 = 3;
/// Number of channels per byte.
const IN_A_BYTE: usize = 8;
/// Length of an analog input (status and value), and of an analog output, bytes.
const ANALOG_INPUT: usize = 4;
const ANALOG_OUTPUT: usize = 2;
/// Addresses of digital outputs and inputs in the memory of a controller without a mailbox.
const DIGITAL_OUTPUTS: u16 = 0x0F00;
const DIGITAL_INPUTS: u16 = 0x1000;

/// A terminal's channels and their values.
pub struct Terminal {
    options: TerminalOptions,
    outputs: Vec<u8>,
    inputs: Vec<u8>,
}

impl Terminal {
    pub fn new(options: &TerminalOptions) -> Terminal {
        let (outputs, inputs) = if options.has_objects() {
            (ANALOG_OUTPUT * usize::from(options.analog_outputs), ANALOG_INPUT * usize::from(options.analog_inputs))
        } else {
            (usize::from(options.digital_outputs).div_ceil(IN_A_BYTE), usize::from(options.digital_inputs).div_ceil(IN_A_BYTE))
        };
        Terminal { options: options.clone(), outputs: vec![0; outputs], inputs: vec![0; inputs] }
    }

    pub fn has_objects(&self) -> bool {
        self.options.has_objects()
    }

    /// Returns the SyncManagers for the terminal's process data, in the order of their numbers, starting at `first`; each byte of digital
    /// outputs has its own.
    pub fn digital_managers(&self) -> Vec<SyncManager> {
        let manager = |start, len: usize, control, kind| SyncManager { start, len: len as u16, control, enable: 1, kind };
        let outputs = (0..self.outputs.len() as u16).map(|at| manager(DIGITAL_OUTPUTS + at, 1, 0x44, 3));
        let inputs = (!self.inputs.is_empty()).then(|| manager(DIGITAL_INPUTS, self.inputs.len(), 0x00, 4));
        outputs.chain(inputs).collect()
    }

    /// Returns the PDOs listed in the EEPROM: those that the terminal sends, then those that it receives.
    pub fn pdos(&self) -> (Vec<Pdo>, Vec<Pdo>) {
        let of = &self.options;
        let entry = |index, sub, bits, kind, name: &str| PdoEntry { of: Entry { index, sub }, bits, kind, name: name.into() };
        let gap = PdoEntry { bits: 14, ..PdoEntry::default() };
        let pdo = |first: u16, number: u8, manager: u8, name: String, entries| Pdo { index: first + u16::from(number), manager: Some(manager), name, entries };
        let object = |first: u16, number: u8| first + 0x10 * u16::from(number);
        if of.has_objects() {
            let input = |number| {
                let index = object(0x6000, number);
                let status = [entry(index, 1, 1, BOOL, "Status__Underrange"), entry(index, 2, 1, BOOL, "Status__Overrange"), gap.clone()];
                let entries = [&status[..], &[entry(index, 0x11, 16, INTEGER16, "Value")]].concat();
                pdo(0x1A00, number, 3, format!("AI Standard Channel {}", number + 1), entries)
            };
            let output = |number| {
                let entries = vec![entry(object(0x7000, number), 0x11, 16, INTEGER16, "Analog output")];
                pdo(0x1600, number, 2, format!("AO Output Channel {}", number + 1), entries)
            };
            return ((0..of.analog_inputs).map(input).collect(), (0..of.analog_outputs).map(output).collect());
        }
        let named = |number| format!("Channel {}", number + 1);
        let inputs_manager = self.outputs.len() as u8;
        let input = |number| pdo(0x1A00, number, inputs_manager, named(number), vec![entry(object(0x6000, number), 1, 1, BOOL, "Input")]);
        let output = |number| pdo(0x1600, number, number / IN_A_BYTE as u8, named(number), vec![entry(object(0x7000, number), 1, 1, BOOL, "Output")]);
        ((0..of.digital_inputs).map(input).collect(), (0..of.digital_outputs).map(output).collect())
    }

    /// Maps the objects that describe the terminal's process data.
    pub fn map(&self, objects: &mut Objects) {
        let (inputs, outputs) = self.pdos();
        for (assignment, pdos) in [(0x1C12u16, outputs), (0x1C13, inputs)] {
            objects.add(assignment, 0, Access::Constant, &[pdos.len() as u8]);
            for (number, pdo) in (1..).zip(&pdos) {
                objects.add(assignment, number, Access::Constant, &pdo.index.to_le_bytes());
                objects.add(pdo.index, 0, Access::Constant, &[pdo.entries.len() as u8]);
                for (sub, entry) in (1..).zip(&pdo.entries) {
                    objects.add(pdo.index, sub, Access::Constant, &entry.of.mapped(entry.bits).to_le_bytes());
                }
            }
        }
    }

    /// Sets the value at an input: 0 or 1, or counts.
    pub fn put(&mut self, number: usize, value: i64) {
        if self.options.has_objects() {
            let at = ANALOG_INPUT * number + 2;
            if let Some(counts) = self.inputs.get_mut(at..at + 2) {
                counts.copy_from_slice(&(value as i16).to_le_bytes());
            }
        } else if let Some(byte) = self.inputs.get_mut(number / IN_A_BYTE) {
            let bit = 1 << (number % IN_A_BYTE);
            *byte = if value == 0 { *byte & !bit } else { *byte | bit };
        }
    }

    /// Returns the terminal's outputs.
    pub fn carried(&self) -> Vec<i64> {
        if self.options.has_objects() {
            return self.outputs.chunks_exact(ANALOG_OUTPUT).map(|counts| i16::from_le_bytes([counts[0], counts[1]]).into()).collect();
        }
        let bit = |number: usize| i64::from(self.outputs[number / IN_A_BYTE] >> (number % IN_A_BYTE) & 1);
        (0..self.options.digital_outputs.into()).map(bit).collect()
    }

    /// Takes outputs from the memory of a SyncManager, which starts at byte `at` of the outputs.
    pub fn take(&mut self, at: usize, bytes: &[u8]) {
        if let Some(to) = self.outputs.get_mut(at..at + bytes.len()) {
            to.copy_from_slice(bytes);
        }
    }

    pub fn inputs(&self) -> &[u8] {
        &self.inputs
    }

    pub fn outputs_len(&self) -> usize {
        self.outputs.len()
    }

    /// Reacts to the loss of the controller: sets the outputs to 0.
    pub fn lose_communication(&mut self) {
        self.outputs.fill(0);
    }
}
