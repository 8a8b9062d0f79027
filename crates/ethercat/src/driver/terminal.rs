// SPDX-License-Identifier: Apache-2.0
//! A terminal on a segment: its inputs and outputs become channels according to their process data entries.
use super::entries::{self, NamedEntry};
use super::options::{ChannelOptions, TerminalOptions};
use crate::coe::Entry;
use crate::main_device::{Field, Mapping};
use cia402::identity::ExpectedIdentity;
use device::counts::Counts;
use device::{Channel, Layout, Number, Slot, Type};

/// A terminal, with the position of its process data.
pub(super) struct Terminal {
    pub name: String,
    /// Position on the line.
    pub at: usize,
    /// Expected identity of the terminal.
    pub expected: ExpectedIdentity,
    inputs: Vec<Point>,
    outputs: Vec<Point>,
}

/// A channel, with the position of its bits.
struct Point {
    channel: String,
    of: Entry,
    bits: usize,
    counts: Counts,
    /// True if the channel's value is a double, counts × scale + offset, rather than the counts.
    is_scaled: bool,
    slot: Slot,
    /// Counts to output while there is no command.
    safe: u64,
    /// Offset from the start of the process data of all subdevices, bits.
    at: usize,
}

impl Terminal {
    /// Creates a terminal with these entries, from which `options` selects the channels.
    ///
    /// # Errors
    /// Fails with a message if a channel refers to an entry that does not exist, or has a value that its entry cannot represent.
    pub fn new(options: &TerminalOptions, entries: &[NamedEntry], layout: &mut Layout) -> Result<Terminal, String> {
        let title = format!("terminal '{}'", options.name);
        let mut terminal = Terminal { name: options.name.clone(), at: options.at, expected: options.expected(), inputs: Vec::new(), outputs: Vec::new() };
        let plain = ChannelOptions::default();
        let chosen: Vec<(&str, &NamedEntry, &ChannelOptions)> = match &options.channels {
            None => entries.iter().map(|of| (of.name.as_str(), of, &plain)).collect(),
            Some(channels) => {
                let found = channels.iter().map(|(name, wanted)| {
                    let text = wanted.entry.as_deref().unwrap_or(name);
                    let missing = || format!("{title} exchanges no entry '{text}'; {}", hints::did_you_mean(text, entries.iter().map(|of| of.name.as_str())));
                    Ok((name.as_str(), entries::find(entries, text).ok_or_else(missing)?, wanted))
                });
                found.collect::<Result<_, String>>()?
            }
        };
        if chosen.is_empty() {
            return Err(format!("{title} exchanges nothing according to its EEPROM; give the vendor's file, esi=, or leave it out if it is a coupler"));
        }
        for (name, of, wanted) in chosen {
            let point = Point::new(format!("{}.{name}", options.name), of, wanted, layout).map_err(|problem| format!("{title}: channel '{name}' {problem}"))?;
            let points = if of.is_output { &mut terminal.outputs } else { &mut terminal.inputs };
            if points.iter().any(|other| other.of == of.of) {
                return Err(format!("{title}: channel '{name}' is an entry that another channel already uses"));
            }
            points.push(point);
        }
        Ok(terminal)
    }

    /// Stores the positions of the terminal's entries.
    ///
    /// # Errors
    /// Fails with a message if one of them is not exchanged.
    pub fn map(&mut self, mapping: &Mapping, outputs_at: usize, inputs_at: usize) -> Result<(), String> {
        for (points, fields, start) in [(&mut self.outputs, &mapping.outputs, outputs_at), (&mut self.inputs, &mapping.inputs, inputs_at)] {
            for point in points {
                let place = fields.iter().find(|field: &&Field| field.of == point.of && field.bits == point.bits);
                let Entry { index, sub } = point.of;
                let missing = || format!("terminal '{}': channel '{}' is entry {index:#06x}:{sub}, which it does not exchange now", self.name, point.channel);
                point.at = 8 * start + place.ok_or_else(missing)?.at;
            }
        }
        Ok(())
    }

    /// Stores the values received from the terminal.
    pub fn read(&self, process: &[u8], readings: &mut [u8]) {
        for point in &self.inputs {
            point.show(bits(process, point.at, point.bits), readings);
        }
    }

    /// Sets the commands for the terminal.
    pub fn write(&self, commands: &[u8], process: &mut [u8]) {
        for point in &self.outputs {
            set_bits(process, point.at, point.bits, point.told(commands));
        }
    }

    /// Sets the safe values of the terminal.
    pub fn be_safe(&self, process: &mut [u8]) {
        for point in &self.outputs {
            set_bits(process, point.at, point.bits, point.safe);
        }
    }
}

impl Point {
    fn new(channel: String, of: &NamedEntry, wanted: &ChannelOptions, layout: &mut Layout) -> Result<Point, String> {
        if let Some(problem) = wanted.problem(of.number, of.is_output) {
            return Err(problem);
        }
        let (counts, is_scaled) = (wanted.of.counts(of.number, of.bits as u32), wanted.of.is_scaled());
        let kind = if is_scaled { Type::DOUBLE } else { Type::of(of.number) };
        let mut point = Point { channel, of: of.of, bits: of.bits, counts, is_scaled, slot: Slot { offset: 0, len: 0 }, safe: 0, at: 0 };
        let doc = if of.title.is_empty() { format!("entry {:#06x}:{}", of.of.index, of.of.sub) } else { of.title.clone() };
        let described = |channel: Channel| channel.unit(wanted.of.unit()).doc(doc);
        point.slot = if of.is_output {
            point.safe = point.told_as(wanted.of.safe());
            let mut bytes = vec![0; kind.number.width()];
            point.store(point.safe, &mut bytes);
            layout.add(described(Channel::write(point.channel.clone(), kind)).safe(bytes))
        } else {
            layout.add(described(Channel::read(point.channel.clone(), kind)))
        };
        Ok(point)
    }

    fn show(&self, counts: u64, readings: &mut [u8]) {
        self.store(counts, self.slot.of_mut(readings));
    }

    /// Stores counts in the channel's value type.
    fn store(&self, counts: u64, to: &mut [u8]) {
        if self.is_scaled {
            return to.copy_from_slice(&self.counts.value(counts).to_ne_bytes());
        }
        match to.len() {
            1 => to.copy_from_slice(&(counts as u8).to_ne_bytes()),
            2 => to.copy_from_slice(&(counts as u16).to_ne_bytes()),
            4 => to.copy_from_slice(&(counts as u32).to_ne_bytes()),
            _ => to.copy_from_slice(&counts.to_ne_bytes()),
        }
    }

    /// Returns the output of the channel; a command that is not a number is replaced by the safe value.
    fn told(&self, commands: &[u8]) -> u64 {
        let command = self.slot.of(commands);
        let mut wide = [0; 8];
        if self.is_scaled {
            let value = self.slot.double(commands, 0);
            return if value.is_finite() { self.told_as(value) } else { self.safe };
        }
        if self.counts.number == Number::Bool {
            return u64::from(command[0] != 0);
        }
        let low = if cfg!(target_endian = "big") { wide.len() - command.len() } else { 0 };
        wide[low..low + command.len()].copy_from_slice(command);
        u64::from_ne_bytes(wide)
    }

    /// Returns the representable counts closest to a value.
    fn told_as(&self, value: f64) -> u64 {
        self.counts.counts(value).map_or(self.safe, |(counts, _)| counts)
    }
}

/// Returns the number stored in `count` bits of process data, of which bit `at` is the least significant.
fn bits(process: &[u8], at: usize, count: usize) -> u64 {
    let mut value = 0;
    let mut done = 0;
    while done < count {
        let (byte, from) = ((at + done) / 8, (at + done) % 8);
        let taken = (8 - from).min(count - done);
        let part = u64::from(process[byte] >> from) & ((1 << taken) - 1);
        value |= part << done;
        done += taken;
    }
    value
}

fn set_bits(process: &mut [u8], at: usize, count: usize, value: u64) {
    let mut done = 0;
    while done < count {
        let (byte, from) = ((at + done) / 8, (at + done) % 8);
        let taken = (8 - from).min(count - done);
        let mask = ((1u16 << taken) - 1) as u8;
        let part = (value >> done) as u8 & mask;
        process[byte] = process[byte] & !(mask << from) | part << from;
        done += taken;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bits_are_read_as_they_were_set_and_no_others_change(at in 0..200usize, count in 1..=64usize, value: u64, before: [u8; 40]) {
            let mut process = before;
            let masked = value & (u64::MAX >> (64 - count));
            set_bits(&mut process, at, count, value);
            prop_assert_eq!(bits(&process, at, count), masked);
            for bit in (0..320).filter(|bit| !(at..at + count).contains(bit)) {
                prop_assert_eq!(bits(&process, bit, 1), bits(&before, bit, 1));
            }
        }
    }
}
