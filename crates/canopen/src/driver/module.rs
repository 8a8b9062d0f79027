// SPDX-License-Identifier: Apache-2.0
//! A CiA 401 input and output module: maps each channel to its object and bit.
use super::options::{ChannelOptions, ModuleOptions, Terminal};
use crate::pdo::{self, Pdo, Pdos, Word};
use cia402::Entry;
use device::counts::Counts;
use device::{Channel, Layout, Number, Slot, Type};

/// Objects of a module: digital terminals in bytes, analog terminals in 16 bits. Each terminal is a bit or a subindex.
const DIGITAL_INPUTS: u16 = 0x6000;
const DIGITAL_OUTPUTS: u16 = 0x6200;
const ANALOG_INPUTS: u16 = 0x6401;
const ANALOG_OUTPUTS: u16 = 0x6411;
/// Objects that make an output take an error value if the controller is lost, and objects with these values; the error values of analog
/// outputs are signed 32-bit numbers.
const DIGITAL_ERROR_MODE: u16 = 0x6206;
const DIGITAL_ERROR_VALUE: u16 = 0x6207;
const ANALOG_ERROR_MODE: u16 = 0x6443;
const ANALOG_ERROR_VALUE: u16 = 0x6444;
/// Number of analog values per PDO.
const ANALOG_IN_ONE: usize = 4;

/// Position of a channel in the process data, and the scaling of its counts.
#[derive(Clone, Copy)]
struct ChannelPlace {
    word: Word,
    /// Bit of a digital channel.
    bit: Option<u8>,
    counts: Counts,
}

struct Input {
    slot: Slot,
    wired: ChannelPlace,
    /// Current value: counts, or 0 or 1.
    seen: i32,
}

struct Output {
    slot: Slot,
    wired: ChannelPlace,
    told: i32,
    safe: i32,
}

/// A module with its terminals.
pub struct Module {
    inputs: Vec<Input>,
    outputs: Vec<Output>,
    error: Slot,
    emergency: u16,
}

impl Module {
    pub fn new(options: &ModuleOptions, layout: &mut Layout) -> Module {
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        let error = Channel::read(format!("{}.error", options.name), Type::of(Number::Uint16)).doc("code of its latest emergency; 0 if it has none");
        let error = layout.add(error);
        for (name, of) in &options.channels {
            let wired = ChannelPlace::new(of);
            let kind = if wired.bit.is_some() { Type::BOOL } else { Type::DOUBLE };
            let (name, doc) = (format!("{}.{name}", options.name), of.terminal().to_string());
            if of.terminal().is_input() {
                inputs.push(Input { slot: layout.add(Channel::read(name, kind).unit(of.of.unit()).doc(doc)), wired, seen: 0 });
            } else {
                let safe = wired.counts(of.of.safe());
                let bytes = if wired.bit.is_some() { vec![safe as u8] } else { wired.value(safe).to_ne_bytes().to_vec() };
                let channel = Channel::write(name, kind).unit(of.of.unit()).doc(doc).safe(bytes);
                outputs.push(Output { slot: layout.add(channel), wired, told: safe, safe });
            }
        }
        Module { inputs, outputs, error, emergency: 0 }
    }

    /// Returns the PDOs that the module sends: digital inputs in PDO 1, analog inputs in the others.
    pub fn inputs(&self) -> Pdos {
        pdos(self.inputs.iter().map(|input| input.wired.word))
    }

    /// Returns the PDOs that the module receives.
    pub fn outputs(&self) -> Pdos {
        pdos(self.outputs.iter().map(|output| output.wired.word))
    }

    /// Returns the groups of terminals that the module needs, each with its object, the number of subindices, and their kind.
    pub fn groups(&self) -> impl Iterator<Item = (u16, u8, &'static str)> {
        let words = || self.inputs.iter().map(|of| of.wired.word).chain(self.outputs.iter().map(|of| of.wired.word));
        [
            (DIGITAL_INPUTS, "bytes of digital inputs"),
            (DIGITAL_OUTPUTS, "bytes of digital outputs"),
            (ANALOG_INPUTS, "analog inputs"),
            (ANALOG_OUTPUTS, "analog outputs"),
        ]
        .into_iter()
        .filter_map(move |(index, what)| {
            let needed = words().filter(|word| (word >> 16) as u16 == index).map(|word| (word >> 8) as u8).max();
            needed.map(|needed| (index, needed, what))
        })
    }

    /// Returns the settings to write to the module, if it supports them, before it goes operational: the values that its outputs take if
    /// the controller is lost.
    pub fn settings(&self) -> Vec<(Entry, Vec<u8>)> {
        let mut settings = Vec::new();
        let mut words: Vec<Word> = self.outputs.iter().map(|output| output.wired.word).collect();
        words.sort_unstable();
        words.dedup();
        for word in words {
            let (sub, safe) = ((word >> 8) as u8, self.safely_carried(word));
            let (mode, all, value, bytes) = match word & 0xFF {
                8 => (DIGITAL_ERROR_MODE, 0xFF, DIGITAL_ERROR_VALUE, vec![safe as u8]),
                _ => (ANALOG_ERROR_MODE, 1, ANALOG_ERROR_VALUE, safe.to_le_bytes().to_vec()),
            };
            settings.push((Entry { index: mode, sub }, vec![all]));
            settings.push((Entry { index: value, sub }, bytes));
        }
        settings
    }

    /// Handles process data from the module.
    pub fn take(&mut self, pdo: &Pdo, bytes: &[u8]) {
        for input in &mut self.inputs {
            if let Some(number) = pdo::number(bytes, pdo, input.wired.word) {
                input.seen = input.wired.bit.map_or(number, |bit| number >> bit & 1);
            }
        }
    }

    pub fn heed(&mut self, code: u16) {
        self.emergency = code;
    }

    /// Stores the values received from the module.
    pub fn show(&self, readings: &mut [u8]) {
        self.error.of_mut(readings).copy_from_slice(&self.emergency.to_ne_bytes());
        for input in &self.inputs {
            match input.wired.bit {
                Some(_) => input.slot.of_mut(readings)[0] = input.seen as u8,
                None => input.slot.set_double(readings, 0, input.wired.value(input.seen)),
            }
        }
    }

    /// Sets the commands for the module.
    pub fn tell(&mut self, commands: &[u8]) {
        for output in &mut self.outputs {
            output.told = match output.wired.bit {
                Some(_) => i32::from(output.slot.of(commands)[0] != 0),
                None => match output.slot.double(commands, 0) {
                    value if value.is_finite() => output.wired.counts(value),
                    _ => output.safe,
                },
            };
        }
    }

    /// Sets the safe values as commands.
    pub fn be_safe(&mut self) {
        self.outputs.iter_mut().for_each(|output| output.told = output.safe);
    }

    /// Returns the commanded value of an object, as sent to the module.
    pub fn carried(&self, word: Word) -> u32 {
        self.joined(word, |output| output.told)
    }

    /// Returns the safe value of an object, as sent to the module.
    pub fn safely_carried(&self, word: Word) -> u32 {
        self.joined(word, |output| output.safe)
    }

    fn joined(&self, word: Word, counts: impl Fn(&Output) -> i32) -> u32 {
        self.outputs.iter().filter(|output| output.wired.word == word).fold(0, |all, output| match output.wired.bit {
            Some(bit) => all | (counts(output) as u32) << bit,
            None => counts(output) as u32,
        })
    }
}

impl ChannelPlace {
    fn new(of: &ChannelOptions) -> ChannelPlace {
        let digital = |index: u16, number: u8| (entry(index, number / 8, 8), Some(number % 8));
        let (word, bit) = match of.terminal() {
            Terminal::Input(number) => digital(DIGITAL_INPUTS, number),
            Terminal::Output(number) => digital(DIGITAL_OUTPUTS, number),
            Terminal::AnalogInput(number) => (entry(ANALOG_INPUTS, number, 16), None),
            Terminal::AnalogOutput(number) => (entry(ANALOG_OUTPUTS, number, 16), None),
        };
        ChannelPlace { word, bit, counts: of.of.counts(Number::Int16, 16) }
    }

    fn value(&self, counts: i32) -> f64 {
        self.counts.value(counts as u64)
    }

    fn counts(&self, value: f64) -> i32 {
        self.counts.counts(value).map_or(0, |(counts, _)| i32::from(counts as i16))
    }
}

/// Returns the object of a terminal group, numbered from 0.
fn entry(index: u16, number: u8, bits: u8) -> Word {
    Entry { index, sub: number + 1 }.mapped(bits)
}

/// Returns PDOs that contain each object once: 8-bit objects in the first, 16-bit objects in the others.
fn pdos(words: impl Iterator<Item = Word>) -> Pdos {
    let mut words: Vec<Word> = words.collect();
    words.sort_unstable();
    words.dedup();
    let (digital, analog): (Vec<Word>, Vec<Word>) = words.into_iter().partition(|word| word & 0xFF == 8);
    let mut pdos = Pdos::default();
    pdos[0].words = digital;
    for (pdo, words) in pdos[1..].iter_mut().zip(analog.chunks(ANALOG_IN_ONE)) {
        pdo.words = words.to_vec();
    }
    pdos
}
