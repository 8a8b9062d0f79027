// SPDX-License-Identifier: Apache-2.0
//! Reading a recording back.
use crate::records::{CHANNEL, CHUNK, DATA_END, MAGIC, MESSAGE, METADATA, Rest};
use crate::{ABOUT, ENDS, LOG, LOSSES, LOST, json};
use indexmap::IndexMap;
use model::refusal::{Class, Refusal, Refusals};
use model::types::Type;
use serde_json::Value as Json;
use std::collections::{BTreeMap, HashMap};
use std::io::Read;
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
        let refused =
            |why: String, remedy: &str| vec![Refusal::new(Class::ValueRefused, format!("cannot read recording '{}': {why}", path.display())).remedy(remedy)];
        let bytes = std::fs::read(path).map_err(|why| refused(why.to_string(), "does the file exist?"))?;
        let Some(bytes) = bytes.strip_prefix(MAGIC) else { return Err(refused("it is no MCAP file".to_owned(), "take a file that cell.record() has made")) };
        let mut recording = Recording::default();
        recording.take(Rest(bytes), &mut HashMap::new());
        if !recording.metadata.contains_key(ABOUT) {
            return Err(refused("it was not made by OpenGPAC".to_owned(), "take a file that cell.record() has made"));
        }
        Ok(recording)
    }

    /// Takes records, up to the end of the data or of what is whole.
    fn take(&mut self, mut records: Rest<'_>, channels: &mut HashMap<u16, String>) {
        while let Some((code, mut fields)) = records.record() {
            let taken = match code {
                DATA_END => {
                    self.complete = true;
                    return;
                }
                CHUNK => unpacked(fields).map(|inner| self.take(Rest(&inner), channels)),
                CHANNEL => (|| {
                    let (id, _schema, topic, _encoding) = (fields.u16()?, fields.u16()?, fields.text()?, fields.text()?);
                    self.define(&topic, &fields.texts()?);
                    channels.insert(id, topic);
                    Some(())
                })(),
                MESSAGE => (|| {
                    let (channel, _sequence, time, _published) = (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
                    self.put(channels.get(&channel)?, time.cast_signed(), fields.0);
                    Some(())
                })(),
                METADATA => (|| {
                    self.metadata.insert(fields.text()?, fields.texts()?);
                    Some(())
                })(),
                _ => Some(()),
            };
            if taken.is_none() {
                // What follows a damaged place cannot be told from damage: the end, for us.
                return;
            }
        }
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

/// The records of a chunk; nothing where it is damaged.
fn unpacked(mut fields: Rest<'_>) -> Option<Vec<u8>> {
    let (_first, _last, size, sum, compression, len) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?, fields.text()?, fields.u64()?);
    let packed = fields.take(usize::try_from(len).ok()?)?;
    let mut records = Vec::new();
    match compression.as_str() {
        "lz4" => lz4_flex::frame::FrameDecoder::new(packed).take(size).read_to_end(&mut records).ok().map(drop)?,
        "" => records.extend(packed),
        _ => return None,
    }
    (records.len() as u64 == size && (sum == 0 || crc32fast::hash(&records) == sum)).then_some(records)
}
