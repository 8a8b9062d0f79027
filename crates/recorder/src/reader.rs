// SPDX-License-Identifier: Apache-2.0
//! Reading a recording back.
use crate::page::JSON;
use crate::{ABOUT, ENDS, LOG, LOSSES, LOST, json};
use indexmap::IndexMap;
use mcap::{Reader, Record, Unreadable};
use model::refusal::{Class, Refusal, Refusals};
use model::types::Type;
use serde_json::Value as Json;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::path::Path;

/// Every value of one SVV or cell in a recording, oldest first.
#[derive(Clone, Debug)]
pub struct Series {
    pub value_type: Type,
    /// `svv` or `cell`.
    pub kind: String,
    pub unit: String,
    pub numbers: Vec<u64>,
    /// ns on the system's clock.
    pub times_ns: Vec<i64>,
    /// The values, one after the other.
    pub bytes: Vec<u8>,
}

/// A recording in memory.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// By SVV or cell, in the order in which they came to be recorded.
    pub series: IndexMap<String, Series>,
    /// Messages of all other channels: (time, message).
    pub records: IndexMap<String, Vec<(i64, Json)>>,
    /// Metadata records, by name.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// False where the file has no end: its recorder was killed, or the disk was full. Everything up to the last whole chunk is here.
    pub complete: bool,
}

impl Recording {
    /// Reads a file. Refused where it cannot be read or is none of ours.
    pub fn open(path: &Path) -> Result<Recording, Refusals> {
        let refused = |why: Unreadable| {
            let remedy = match why {
                Unreadable::File(_) => "does the file exist?",
                Unreadable::Compressed { .. } => "decompress it first, for example with 'mcap decompress'",
                Unreadable::NoMcap | Unreadable::Damaged { .. } => OURS,
            };
            cannot_read(path, &why, remedy)
        };
        let file = File::open(path).map_err(|why| refused(why.into()))?;
        let mut recording = Recording::default();
        recording.take(Reader::new(file).map_err(refused)?).map_err(refused)?;
        if !recording.metadata.contains_key(ABOUT) {
            return Err(cannot_read(path, &"it was not made by OpenGPAC", OURS));
        }
        Ok(recording)
    }

    /// Takes records, up to the end of the data or of what is whole.
    fn take(&mut self, mut file: Reader<File>) -> Result<(), Unreadable> {
        let mut channels = HashMap::new();
        loop {
            match file.next_record() {
                Ok(Some(Record::Channel { id, topic, encoding, metadata })) if encoding == JSON => {
                    self.define(&topic, &metadata);
                    channels.insert(id, topic);
                }
                Ok(Some(Record::Message { channel, time, data, .. })) => {
                    if let Some(topic) = channels.get(&channel) {
                        self.put(topic, time.cast_signed(), data);
                    }
                }
                Ok(Some(Record::Metadata { name, texts })) => {
                    self.metadata.insert(name, texts);
                }
                // What a replay reads.
                Ok(Some(Record::Channel { .. })) => {}
                // What follows a damaged place cannot be told from damage: the end, for us.
                Ok(None) | Err(Unreadable::Damaged { .. }) => break,
                Err(why) => return Err(why),
            }
        }
        self.complete = file.is_whole();
        Ok(())
    }

    fn define(&mut self, topic: &str, metadata: &BTreeMap<String, String>) {
        let text = |name: &str| metadata.get(name).cloned().unwrap_or_default();
        match (metadata.get("kind"), Type::parse(&text("type"), &IndexMap::new())) {
            (Some(kind), Ok(value_type)) => {
                let fresh = || Series { value_type, kind: kind.clone(), unit: text("unit"), numbers: Vec::new(), times_ns: Vec::new(), bytes: Vec::new() };
                self.series.entry(topic.to_owned()).or_insert_with(fresh);
            }
            _ => {
                self.records.entry(topic.to_owned()).or_default();
            }
        }
    }

    fn put(&mut self, topic: &str, time_ns: i64, data: &[u8]) {
        let Ok(message) = serde_json::from_slice::<Json>(data) else { return };
        if let Some(series) = self.series.get_mut(topic) {
            let start = series.bytes.len();
            if json::read(&series.value_type, &message["value"], &mut series.bytes) {
                series.numbers.push(message["number"].as_u64().unwrap_or(0));
                series.times_ns.push(time_ns);
            } else {
                series.bytes.truncate(start);
            }
        } else if let Some(records) = self.records.get_mut(topic) {
            records.push((time_ns, message));
        }
    }

    /// Entries of the log.
    pub fn log(&self) -> impl Iterator<Item = &Json> {
        self.records.get(LOG).into_iter().flatten().map(|(_, entry)| entry)
    }

    /// End reports.
    pub fn ends(&self) -> impl Iterator<Item = &Json> {
        self.records.get(ENDS).into_iter().flatten().map(|(_, end)| end)
    }

    /// What was lost, by channel. Of a file without an end: as far as it says so.
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

pub(crate) const OURS: &str = "take a file that cell.record() has made";

pub(crate) fn cannot_read(path: &Path, why: &dyn std::fmt::Display, remedy: &str) -> Refusals {
    vec![Refusal::new(Class::ValueRefused, format!("cannot read recording '{}': {why}", path.display())).remedy(remedy)]
}
