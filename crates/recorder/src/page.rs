// SPDX-License-Identifier: Apache-2.0
//! Pages: batches of messages to be written to the file.
use crate::GEOMETRY;
use mcap::Schema;
use std::collections::BTreeMap;

/// Encodings of messages and of their schemas.
pub(crate) const JSON: &str = "json";
pub(crate) const JSON_SCHEMA: &str = "jsonschema";

/// Channel of the file, returned by [`Page::channel`]. Valid for all pages of the same recorder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChannelId(pub(crate) usize);

/// Description of a channel.
#[derive(Clone, Debug)]
pub(crate) struct Definition {
    pub topic: String,
    /// Encoding of the channel's messages: JSON, or a named binary encoding.
    pub encoding: &'static str,
    pub schema: Option<Schema>,
    pub metadata: BTreeMap<String, String>,
}

impl Definition {
    /// Returns true for channels with few messages, such as the log, ends and statistics. Readers read their messages as a whole, instead
    /// of collecting them from all chunks that contain values.
    pub fn is_apart(&self) -> bool {
        self.encoding == JSON && !self.metadata.contains_key("kind")
    }

    /// Returns true for a value or the shape of a device, which remains valid until the next message on its channel.
    pub fn is_state(&self) -> bool {
        self.metadata.contains_key("kind") || self.topic.starts_with(GEOMETRY)
    }
}

pub(crate) struct Entry {
    pub channel: ChannelId,
    pub time_ns: i64,
    pub sequence: u32,
    /// End of the message's bytes; they start at the end of the previous message.
    pub end: usize,
}

/// Messages of the sources since the previous page. Its memory is reused.
#[derive(Default)]
pub struct Page {
    /// Number of channels that precede the first one of this page.
    pub(crate) first: usize,
    pub(crate) definitions: Vec<Definition>,
    pub(crate) entries: Vec<Entry>,
    pub(crate) bytes: Vec<u8>,
    /// Number of values of each channel that were lost before they became messages.
    pub(crate) lost: BTreeMap<ChannelId, u64>,
}

impl Page {
    /// Adds a new channel. `topic` is its name in the file; `schema` is the name and JSON schema of its messages, an object.
    pub fn channel(&mut self, topic: &str, schema: (&str, &serde_json::Value), metadata: BTreeMap<String, String>) -> ChannelId {
        let schema = Schema { name: schema.0.to_owned(), encoding: JSON_SCHEMA, text: schema.1.to_string() };
        self.define(Definition { topic: topic.to_owned(), encoding: JSON, schema: Some(schema), metadata })
    }

    /// Adds a new channel for non-JSON messages in the named `encoding`.
    pub fn channel_of_bytes(&mut self, topic: &str, encoding: &'static str) -> ChannelId {
        self.define(Definition { topic: topic.to_owned(), encoding, schema: None, metadata: BTreeMap::new() })
    }

    fn define(&mut self, of: Definition) -> ChannelId {
        self.definitions.push(of);
        ChannelId(self.first + self.definitions.len() - 1)
    }

    /// Adds a message. `time_ns` is on the system's clock; `sequence` is the number that tools display.
    pub fn put(&mut self, channel: ChannelId, time_ns: i64, sequence: u64, fill: impl FnOnce(&mut Vec<u8>)) {
        fill(&mut self.bytes);
        #[allow(clippy::cast_possible_truncation, reason = "the lower half is what a file holds")]
        let sequence = sequence as u32;
        self.entries.push(Entry { channel, time_ns, sequence, end: self.bytes.len() });
    }

    /// Counts messages of a channel that were lost before they reached the page.
    pub fn lost(&mut self, channel: ChannelId, count: u64) {
        if count > 0 {
            *self.lost.entry(channel).or_default() += count;
        }
    }

    /// Returns the messages with their bytes.
    pub(crate) fn messages(&self) -> impl Iterator<Item = (&Entry, &[u8])> {
        let starts = std::iter::once(0).chain(self.entries.iter().map(|entry| entry.end));
        self.entries.iter().zip(starts).map(|(entry, start)| (entry, &self.bytes[start..entry.end]))
    }

    /// Counts the page's messages as lost, because the buffer is full. Its channels are kept.
    pub(crate) fn give_up(&mut self) {
        for entry in self.entries.drain(..) {
            *self.lost.entry(entry.channel).or_default() += 1;
        }
        self.bytes.clear();
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty() && self.definitions.is_empty() && self.lost.is_empty()
    }

    /// Returns the approximate size of the page in memory, bytes.
    pub(crate) fn len(&self) -> usize {
        self.bytes.len() + self.entries.len() * size_of::<Entry>()
    }

    /// Empties the page for the next messages.
    pub(crate) fn renew(&mut self, first: usize) {
        self.first = first;
        self.definitions.clear();
        self.entries.clear();
        self.bytes.clear();
        self.lost.clear();
    }
}
