// SPDX-License-Identifier: Apache-2.0
//! Values of SVVs and cells, each with its number and time.
//!
//! A block stores one value per firing. The programming system may store any number of values while the clock stands still, and a block
//! may also store at the same time. Blocks only ever read the last of these values, so the others are not recorded: the newest value that
//! was not stored by a block is held back until the clock has passed its time.
use crate::json;
use crate::page::{ChannelId, Page};
use model::types::{Scalar, Type};
use std::collections::BTreeMap;
use supervisor::{Run, Samples, Tap, TapChannel};

/// Every value of the SVVs and cells that a tap observes.
pub(crate) struct Values {
    pub tap: Tap,
    samples: Samples,
    channels: Vec<Channel>,
}

/// One SVV or cell in the file.
struct Channel {
    id: ChannelId,
    value_type: Type,
    held: Option<HeldValue>,
}

/// A value that was not stored by a block, held back until the clock has passed its time.
struct HeldValue {
    time_ns: i64,
    number: u64,
    bytes: Vec<u8>,
}

impl Values {
    pub fn new(tap: Tap) -> Values {
        Values { tap, samples: Samples::default(), channels: Vec::new() }
    }

    /// Appends the new values. No more values will be stored before `passed_ns`; later values of the programming system are held back.
    pub fn drain(&mut self, page: &mut Page, passed_ns: i64) {
        self.tap.take(&mut self.samples);
        let new = &self.tap.channels()[self.channels.len()..];
        self.channels.extend(new.iter().map(|of| Channel::new(of, page)));
        for (run, channel) in self.samples.runs.iter().zip(&mut self.channels) {
            channel.take(run, page);
            channel.release(page, passed_ns);
        }
    }
}

impl Channel {
    fn new(of: &TapChannel, page: &mut Page) -> Channel {
        // The type of a running SVV has been parsed before.
        let value_type = Type::parse(&of.type_text, &Default::default()).unwrap_or(Type::Array(Box::new(Type::Scalar(Scalar::Uint8)), of.size));
        let kind = if of.name.contains(':') { "cell" } else { "svv" };
        let metadata = [("kind", kind), ("type", of.type_text.as_str()), ("unit", of.unit.as_str())];
        let metadata: BTreeMap<String, String> = metadata.map(|(name, text)| (name.to_owned(), text.to_owned())).into();
        let schema = json::schema(&value_type, &of.unit);
        let name = format!("opengpac.value {} {}", of.type_text, of.unit);
        Channel { id: page.channel(&of.name, (name.trim_end(), &schema), metadata), value_type, held: None }
    }

    fn take(&mut self, run: &Run, page: &mut Page) {
        page.lost(self.id, run.lost);
        let size = self.value_type.size();
        for (index, (number, time_ns)) in run.numbers.iter().zip(&run.times_ns).enumerate() {
            let bytes = &run.bytes[index * size..][..size];
            if self.held.as_ref().is_some_and(|held| held.time_ns == *time_ns) {
                self.held = None;
            }
            self.release(page, i64::MAX);
            if run.by_block[index] {
                self.put(page, *time_ns, *number, bytes);
            } else {
                self.held = Some(HeldValue { time_ns: *time_ns, number: *number, bytes: bytes.to_vec() });
            }
        }
    }

    /// Appends the value that is held back, if the clock has passed its time.
    fn release(&mut self, page: &mut Page, passed_ns: i64) {
        if let Some(held) = self.held.take_if(|held| held.time_ns < passed_ns) {
            self.put(page, held.time_ns, held.number, &held.bytes);
        }
    }

    fn put(&self, page: &mut Page, time_ns: i64, number: u64, bytes: &[u8]) {
        page.put(self.id, time_ns, number, |out| {
            out.extend_from_slice(b"{\"number\":");
            out.extend_from_slice(number.to_string().as_bytes());
            out.extend_from_slice(b",\"value\":");
            json::write(&self.value_type, bytes, out);
            out.push(b'}');
        });
    }
}
