// SPDX-License-Identifier: Apache-2.0
//! Reads a recording into memory.
use crate::page::JSON;
use crate::{ABOUT, ENDS, LOG, LOSSES, LOST, json};
use indexmap::IndexMap;
use mcap::{Channel, Chunk, Damage, IndexedFile, Unreadable};
use model::refusal::{Class, Refusal, Refusals};
use model::types::Type;
use serde::Serialize;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

/// Every value of one SVV or cell in a recording, oldest first.
#[derive(Clone, Debug)]
pub struct Series {
    pub value_type: Type,
    /// Kind: `svv` or `cell`.
    pub kind: String,
    pub unit: String,
    pub numbers: Vec<u64>,
    /// Times of the values, in ns on the system's clock.
    pub times_ns: Vec<i64>,
    /// Values, stored consecutively.
    pub bytes: Vec<u8>,
}

/// An unreadable part of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DamagedPart {
    /// Offset of the first byte of the part in the file; `ends` is the offset after its last byte.
    pub begins: u64,
    pub ends: u64,
    pub what: String,
    /// Bounds on the times of the lost messages, ns on the system's clock, if the file contains them.
    pub from_ns: Option<i64>,
    pub to_ns: Option<i64>,
    /// Number of lost messages by channel: empty if none is lost, `None` if the file does not contain the numbers.
    pub lost: Option<BTreeMap<String, u64>>,
}

impl DamagedPart {
    /// Returns the damage in file order, with the names of the channels.
    pub(crate) fn all(mut found: Vec<Damage>, channels: &BTreeMap<u16, Channel>) -> Vec<DamagedPart> {
        found.sort_by_key(|damage| damage.bytes.start);
        found.into_iter().map(|damage| DamagedPart::of(damage, channels)).collect()
    }

    fn of(damage: Damage, channels: &BTreeMap<u16, Channel>) -> DamagedPart {
        let Damage { bytes, what, span, counts } = damage;
        let name = |id: u16| channels.get(&id).map_or_else(|| format!("channel {id}"), |channel| channel.topic.clone());
        let lost = counts.map(|counts| {
            let mut lost = BTreeMap::new();
            for (id, count) in counts {
                *lost.entry(name(id)).or_default() += count as u64;
            }
            lost
        });
        let (from_ns, to_ns) = span.map(|(from, to)| (from.cast_signed(), to.cast_signed())).unzip();
        DamagedPart { begins: bytes.start, ends: bytes.end, what: what.to_owned(), from_ns, to_ns, lost }
    }
}

/// A recording in memory.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Series of each SVV or cell, in the order in which their recording started.
    pub series: IndexMap<String, Series>,
    /// Messages of all other channels: (time, message).
    pub records: IndexMap<String, Vec<(i64, Json)>>,
    /// Metadata records, by name.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// False if the file has no end record because its recorder was killed or the disk was full. The recording then contains everything
    /// up to the last complete chunk.
    pub complete: bool,
    /// Unreadable parts of the file, in order. The recording contains everything else.
    pub damage: Vec<DamagedPart>,
}

impl Recording {
    /// Reads a file. Fails if it cannot be read or is not a recording of OpenGPAC.
    pub fn open(path: &Path) -> Result<Recording, Refusals> {
        let refused = |why: Unreadable| {
            let remedy = match why {
                Unreadable::File(_) => "check that the file exists",
                Unreadable::Compressed { .. } => "decompress it first, for example with 'mcap decompress'",
                Unreadable::NoMcap | Unreadable::Damaged { .. } => OURS,
            };
            cannot_read(path, &why, remedy)
        };
        let file = File::open(path).map_err(|why| refused(why.into()))?;
        let mut recording = Recording::default();
        recording.take(IndexedFile::open(file).map_err(refused)?).map_err(refused)?;
        // A damaged file may have lost the record that identifies it.
        if !recording.metadata.contains_key(ABOUT) && (recording.damage.is_empty() || recording.series.is_empty()) {
            return Err(cannot_read(path, &"it was not made by OpenGPAC", OURS));
        }
        Ok(recording)
    }

    /// Reads all readable parts of a file.
    fn take(&mut self, mut file: IndexedFile) -> Result<(), Unreadable> {
        let mut damage = file.damage();
        for channel in file.channels.values() {
            self.define(channel);
        }
        for at in 0..file.chunks.len() {
            match file.chunk(at) {
                Ok(chunk) => {
                    for (id, channel) in &chunk.channels {
                        self.define(channel);
                        file.channels.entry(*id).or_insert_with(|| channel.clone());
                    }
                    let lost = self.put_all(&chunk, &file.channels);
                    if !lost.is_empty() {
                        damage.push(Damage { counts: Some(lost), ..file.damage_of(at, "messages do not match their channels, or belong to no known channel") });
                    }
                }
                Err(Unreadable::Damaged { what, .. }) => damage.push(file.damage_of(at, what)),
                Err(why) => return Err(why),
            }
        }
        self.damage = DamagedPart::all(damage, &file.channels);
        self.metadata = std::mem::take(&mut file.metadata);
        self.complete = file.is_whole();
        Ok(())
    }

    /// Reads the messages of a chunk; returns the number of invalid messages of each channel.
    fn put_all(&mut self, chunk: &Chunk, channels: &BTreeMap<u16, Channel>) -> BTreeMap<u16, usize> {
        let mut lost = BTreeMap::new();
        for (id, messages) in &chunk.messages {
            let channel = channels.get(id);
            // These messages are for a replay.
            if channel.is_some_and(|channel| channel.encoding != JSON) {
                continue;
            }
            for message in messages {
                if !channel.is_some_and(|channel| self.put(&channel.topic, message.time.cast_signed(), chunk.data(message))) {
                    *lost.entry(*id).or_default() += 1;
                }
            }
        }
        lost
    }

    fn define(&mut self, channel: &Channel) {
        let Channel { topic, encoding, metadata } = channel;
        if encoding != JSON {
            return;
        }
        let text = |name: &str| metadata.get(name).cloned().unwrap_or_default();
        match (metadata.get("kind"), Type::parse(&text("type"), &IndexMap::new())) {
            (Some(kind), Ok(value_type)) => {
                let fresh = || Series { value_type, kind: kind.clone(), unit: text("unit"), numbers: Vec::new(), times_ns: Vec::new(), bytes: Vec::new() };
                self.series.entry(topic.clone()).or_insert_with(fresh);
            }
            _ => {
                self.records.entry(topic.clone()).or_default();
            }
        }
    }

    /// Reads a message; returns false if it is not a valid message of its channel.
    fn put(&mut self, topic: &str, time_ns: i64, data: &[u8]) -> bool {
        let Ok(message) = serde_json::from_slice::<Json>(data) else { return false };
        if let Some(series) = self.series.get_mut(topic) {
            let start = series.bytes.len();
            if !json::read(&series.value_type, &message["value"], &mut series.bytes) {
                series.bytes.truncate(start);
                return false;
            }
            series.numbers.push(message["number"].as_u64().unwrap_or(0));
            series.times_ns.push(time_ns);
        } else if let Some(records) = self.records.get_mut(topic) {
            records.push((time_ns, message));
        }
        true
    }

    /// Returns the entries of the log.
    pub fn log(&self) -> impl Iterator<Item = &Json> {
        self.records.get(LOG).into_iter().flatten().map(|(_, entry)| entry)
    }

    /// Returns the end reports.
    pub fn ends(&self) -> impl Iterator<Item = &Json> {
        self.records.get(ENDS).into_iter().flatten().map(|(_, end)| end)
    }

    /// Returns the number of lost messages by channel; if the file has no end record, only the losses that it contains.
    pub fn lost(&self) -> BTreeMap<String, u64> {
        if let Some(lost) = self.metadata.get(LOST) {
            return lost.iter().map(|(channel, count)| (channel.clone(), count.parse().unwrap_or(0))).collect();
        }
        let mut lost = BTreeMap::new();
        for (_, loss) in self.records.get(LOSSES).into_iter().flatten() {
            if let (Some(channel), Some(count)) = (loss["channel"].as_str(), loss["count"].as_u64()) {
                *lost.entry(channel.to_owned()).or_default() += count;
            }
        }
        lost
    }
}

pub(crate) const OURS: &str = "give a file that was recorded with cell.record()";

pub(crate) fn cannot_read(path: &Path, why: &dyn std::fmt::Display, remedy: &str) -> Refusals {
    vec![Refusal::new(Class::ValueRefused, format!("cannot read recording '{}': {why}", path.display())).remedy(remedy)]
}
