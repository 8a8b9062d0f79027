// SPDX-License-Identifier: Apache-2.0
//! The file of a recording: collects messages into chunks, and keeps an exact count of written and lost messages.
use crate::folder::Sink;
use crate::page::{ChannelId, Definition, JSON, JSON_SCHEMA, Page};
use crate::{LOSSES, LOST};
use mcap::Schema;
use std::collections::BTreeMap;
use std::io;
use std::time::{Duration, Instant};

/// Message counts of one channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Count {
    pub topic: String,
    id: u16,
    /// Number of messages in the file, in complete chunks.
    pub written: u64,
    /// Number of messages in the chunk that is being filled.
    pending: u64,
    /// Number of messages that were lost.
    pub lost: u64,
    /// Number of messages that were lost before this file was started.
    lost_before: u64,
}

/// Last message of a channel that represents a state; the next file starts with it.
#[derive(Default)]
struct LastMessage {
    time_ns: i64,
    sequence: u32,
    bytes: Vec<u8>,
}

/// Start of the next file: every channel, and the last message of each channel that represents a state.
#[derive(Default)]
struct Prelude {
    definitions: Vec<Definition>,
    last: Vec<Option<LastMessage>>,
}

impl Prelude {
    fn learn(&mut self, page: &Page) {
        self.definitions.extend(page.definitions.iter().cloned());
        self.last.resize_with(self.definitions.len(), || None);
        for (entry, bytes) in page.messages().filter(|(entry, _)| self.definitions[entry.channel.0].is_state()) {
            let last = self.last[entry.channel.0].get_or_insert_default();
            (last.time_ns, last.sequence) = (entry.time_ns, entry.sequence);
            last.bytes.clear();
            last.bytes.extend_from_slice(bytes);
        }
    }
}

/// File of a recording.
pub(crate) struct Book {
    writer: Option<mcap::Writer<Box<dyn Sink>>>,
    pub counts: Vec<Count>,
    /// End of the last complete chunk, as an offset in bytes.
    pub bytes: u64,
    since: Instant,
    /// Maximum time for which messages are collected into a chunk.
    chunk_max: Duration,
    pub failure: Option<String>,
    losses: Option<u16>,
    /// Start of the next file; `None` if no file follows.
    prelude: Option<Prelude>,
}

/// Starts a file by writing its description.
fn begun(sink: Box<dyn Sink>, about: (&str, &BTreeMap<String, String>)) -> io::Result<mcap::Writer<Box<dyn Sink>>> {
    let mut writer = mcap::Writer::new(sink, concat!("opengpac ", env!("CARGO_PKG_VERSION")))?;
    writer.metadata(about.0, about.1)?;
    Ok(writer)
}

impl Book {
    /// Starts the file by writing its description. Messages are collected into a chunk for at most `chunk_max`; `goes_on` is true if
    /// other files may follow.
    pub fn new(sink: Box<dyn Sink>, about: (&str, &BTreeMap<String, String>), chunk_max: Duration, goes_on: bool) -> io::Result<Book> {
        let writer = begun(sink, about)?;
        let (bytes, prelude) = (writer.position(), goes_on.then(Prelude::default));
        Ok(Book { writer: Some(writer), counts: Vec::new(), bytes, since: Instant::now(), chunk_max, failure: None, losses: None, prelude })
    }

    /// Finishes this file and returns its size; continues in the next file, which declares every channel and starts with the last message
    /// of each channel that represents a state.
    pub fn go_on(&mut self, sink: Box<dyn Sink>, about: (&str, &BTreeMap<String, String>)) -> u64 {
        self.finish();
        let whole = self.bytes;
        if self.failure.is_some() {
            return whole;
        }
        match begun(sink, about) {
            Ok(writer) => self.bytes = self.writer.insert(writer).position(),
            Err(why) => self.failure = Some(why.to_string()),
        }
        self.losses = None;
        let Some(prelude) = &self.prelude else { return whole };
        let counts = self.counts.iter_mut().zip(&prelude.definitions).zip(&prelude.last);
        for ((count, definition), last) in counts {
            (count.id, count.lost_before) = (enter(self.writer.as_mut(), definition), count.lost);
            if let (Some(writer), Some(last)) = (&mut self.writer, last.as_ref().filter(|_| count.id > 0)) {
                writer.put(count.id, last.sequence, u64::try_from(last.time_ns).unwrap_or(0), &last.bytes);
            }
        }
        whole
    }

    /// Writes the description of the file again; readers use the last one in the file.
    pub fn say(&mut self, about: (&str, &BTreeMap<String, String>)) {
        self.finish_chunk();
        let Some(writer) = &mut self.writer else { return };
        match writer.metadata(about.0, about.1) {
            Ok(()) => self.bytes = writer.position(),
            Err(why) => self.fail(&why),
        }
    }

    /// Writes a page. Messages that cannot be written are counted.
    pub fn write(&mut self, page: &Page) {
        for of in &page.definitions {
            let id = enter(self.writer.as_mut(), of);
            self.counts.push(Count { topic: of.topic.clone(), id, ..Count::default() });
        }
        self.prelude.iter_mut().for_each(|prelude| prelude.learn(page));
        for (channel, count) in &page.lost {
            self.counts[channel.0].lost += count;
            self.tell_loss(*channel, *count, page);
        }
        for (entry, bytes) in page.messages() {
            let count = &mut self.counts[entry.channel.0];
            let Some(writer) = self.writer.as_mut().filter(|_| count.id > 0) else {
                count.lost += 1;
                continue;
            };
            count.pending += 1;
            writer.put(count.id, entry.sequence, u64::try_from(entry.time_ns).unwrap_or(0), bytes);
            if writer.is_full() {
                self.finish_chunks(mcap::Writer::finish_full);
            }
        }
        if self.since.elapsed() >= self.chunk_max {
            self.since = Instant::now();
            self.finish_chunk();
        }
    }

    /// Writes the number of lost messages, with the time of the next message.
    fn tell_loss(&mut self, channel: ChannelId, count: u64, page: &Page) {
        let time = page.entries.first().map_or(0, |entry| u64::try_from(entry.time_ns).unwrap_or(0));
        let Some(writer) = &mut self.writer else { return };
        if self.losses.is_none() {
            let text = r#"{"type":"object","properties":{"channel":{"type":"string"},"count":{"type":"integer"}}}"#;
            let schema = Schema { name: "opengpac.lost".to_owned(), encoding: JSON_SCHEMA, text: text.to_owned() };
            self.losses = writer.channel(LOSSES, JSON, Some(&schema), &BTreeMap::new());
            self.losses.into_iter().for_each(|id| writer.set_apart(id));
        }
        if let Some(id) = self.losses {
            let text = serde_json::json!({"channel": self.counts[channel.0].topic, "count": count}).to_string();
            writer.put(id, 0, time, text.as_bytes());
        }
    }

    /// Writes the chunk to the file as a unit.
    fn finish_chunk(&mut self) {
        self.finish_chunks(mcap::Writer::finish_chunk);
    }

    fn finish_chunks(&mut self, chunks: impl Fn(&mut mcap::Writer<Box<dyn Sink>>) -> io::Result<()>) {
        let Some(writer) = &mut self.writer else { return };
        match chunks(writer) {
            Ok(()) => {
                self.bytes = writer.position();
                for count in self.counts.iter_mut().filter(|count| !writer.is_filling(count.id)) {
                    count.written += std::mem::take(&mut count.pending);
                }
            }
            Err(why) => self.fail(&why),
        }
    }

    /// Ends the file after its last complete chunk; pending messages are lost.
    fn fail(&mut self, why: &io::Error) {
        let Some(writer) = self.writer.take() else { return };
        for count in &mut self.counts {
            count.lost += std::mem::take(&mut count.pending);
        }
        let cut = writer.into_sink().cut(self.bytes).err().map(|more| format!("; its last chunk is incomplete: {more}"));
        self.failure = Some(format!("{why}{}", cut.unwrap_or_default()));
    }

    /// Finishes the file, including the numbers of lost messages.
    pub fn finish(&mut self) {
        self.finish_chunk();
        let lost = self.counts.iter().map(|count| (count, count.lost - count.lost_before)).filter(|(_, lost)| *lost > 0);
        let lost = lost.map(|(count, lost)| (count.topic.clone(), lost.to_string())).collect();
        let Some(writer) = &mut self.writer else { return };
        match writer.metadata(LOST, &lost).and_then(|()| writer.finish()) {
            Ok(()) => {
                self.bytes = writer.position();
                self.writer = None;
            }
            Err(why) => self.fail(&why),
        }
    }
}

/// Registers a channel and returns its number. Any channel beyond the maximum of 65,535 per file is assigned the number 0, and all its
/// messages are lost.
fn enter(writer: Option<&mut mcap::Writer<Box<dyn Sink>>>, of: &Definition) -> u16 {
    let Some(writer) = writer else { return 0 };
    let id = writer.channel(&of.topic, of.encoding, of.schema.as_ref(), &of.metadata);
    id.into_iter().filter(|_| of.is_apart()).for_each(|id| writer.set_apart(id));
    id.unwrap_or(0)
}
