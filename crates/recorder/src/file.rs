// SPDX-License-Identifier: Apache-2.0
//! The file: messages into chunks, and exact counts of what reached it and what did not.
use crate::page::{ChannelId, Definition, JSON, JSON_SCHEMA, Page};
use crate::{LOSSES, LOST};
use mcap::Schema;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Where a recording goes.
pub trait Sink: Write + Send {
    /// Gives up what lies behind the first `len` bytes.
    fn cut(&mut self, len: u64) -> io::Result<()>;
}

impl Sink for File {
    fn cut(&mut self, len: u64) -> io::Result<()> {
        self.set_len(len)
    }
}

/// Messages of one channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Count {
    pub topic: String,
    id: u16,
    /// In the file, in whole chunks.
    pub written: u64,
    /// In the chunk that is being filled.
    pending: u64,
    /// Neither.
    pub lost: u64,
}

/// A recording's file.
pub(crate) struct Book {
    writer: Option<mcap::Writer<Box<dyn Sink>>>,
    pub counts: Vec<Count>,
    /// End of the last whole chunk.
    pub bytes: u64,
    since: Instant,
    /// How long a chunk is filled.
    chunk_max: Duration,
    pub failure: Option<String>,
    losses: Option<u16>,
}

impl Book {
    /// Begins the file with what is said of it. A chunk is filled for `chunk_max`.
    pub fn new(sink: Box<dyn Sink>, about: (&str, &BTreeMap<String, String>), chunk_max: Duration) -> io::Result<Book> {
        let mut writer = mcap::Writer::new(sink, concat!("opengpac ", env!("CARGO_PKG_VERSION")))?;
        writer.metadata(about.0, about.1)?;
        let bytes = writer.position();
        Ok(Book { writer: Some(writer), counts: Vec::new(), bytes, since: Instant::now(), chunk_max, failure: None, losses: None })
    }

    /// Says anew what the file is about: who reads it takes what was said last.
    pub fn say(&mut self, about: (&str, &BTreeMap<String, String>)) {
        self.finish_chunk();
        let Some(writer) = &mut self.writer else { return };
        match writer.metadata(about.0, about.1) {
            Ok(()) => self.bytes = writer.position(),
            Err(why) => self.fail(&why),
        }
    }

    /// Writes a page. What cannot be written is counted.
    pub fn write(&mut self, page: &Page) {
        for definition in &page.definitions {
            self.define(definition);
        }
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

    /// A channel beyond the 65,535 that a file can have gets no number: all of it is lost.
    fn define(&mut self, of: &Definition) {
        let id = self.writer.as_mut().and_then(|writer| {
            let id = writer.channel(&of.topic, of.encoding, of.schema.as_ref(), &of.metadata)?;
            if of.is_apart() {
                writer.set_apart(id);
            }
            Some(id)
        });
        let id = id.unwrap_or(0);
        self.counts.push(Count { topic: of.topic.clone(), id, ..Count::default() });
    }

    /// What was lost stands in the file, at the time of what came next.
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

    /// The chunks reach the file, each as a whole.
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

    /// The file ends with its last whole chunk; what was on its way is lost.
    fn fail(&mut self, why: &io::Error) {
        let Some(writer) = self.writer.take() else { return };
        for count in &mut self.counts {
            count.lost += std::mem::take(&mut count.pending);
        }
        let cut = writer.into_sink().cut(self.bytes).err().map(|more| format!("; its last chunk is incomplete: {more}"));
        self.failure = Some(format!("{why}{}", cut.unwrap_or_default()));
    }

    /// The end of the file, with what was lost in it.
    pub fn finish(&mut self) {
        self.finish_chunk();
        let lost = self.counts.iter().filter(|count| count.lost > 0).map(|count| (count.topic.clone(), count.lost.to_string())).collect();
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
