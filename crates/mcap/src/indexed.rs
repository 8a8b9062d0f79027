// SPDX-License-Identifier: Apache-2.0
//! Reading an MCAP file in place: where its chunks lie, and one chunk at a time. Nothing but heads is read before a chunk is asked for.
use crate::Record;
use crate::reader::{LEN_MAX, SHORT, Unreadable, record, unpack};
use crate::records::{CHANNEL, CHUNK, DATA_END, FOOTER, MAGIC, MESSAGE, MESSAGE_INDEX, METADATA, Rest};
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;

/// A channel of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    pub topic: String,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

/// Where a chunk lies, and what the file says of it.
#[derive(Clone, Debug)]
pub struct ChunkIndex {
    /// Its fields, in bytes of the file.
    fields: Range<u64>,
    /// The smallest and the largest time of its messages, ns.
    pub first: u64,
    pub last: u64,
    /// Number of messages of each channel that has any.
    pub counts: BTreeMap<u16, usize>,
}

/// A message in the memory of its chunk.
#[derive(Clone, Debug)]
pub struct Message {
    pub time: u64,
    data: Range<usize>,
}

/// A chunk in memory.
#[derive(Debug, Default)]
pub struct Chunk {
    content: Vec<u8>,
    /// By channel, in the order of the file.
    pub messages: BTreeMap<u16, Vec<Message>>,
    /// Channels that are defined in it.
    pub channels: BTreeMap<u16, Channel>,
}

impl Chunk {
    pub fn data(&self, message: &Message) -> &[u8] {
        &self.content[message.data.clone()]
    }

    /// Takes a chunk's records apart.
    fn of(content: Vec<u8>) -> Option<Chunk> {
        let mut chunk = Chunk::default();
        let mut rest = Rest(&content);
        while !rest.0.is_empty() {
            let (code, fields) = rest.record()?;
            let end = content.len() - rest.0.len();
            if !matches!(code, CHANNEL | MESSAGE) {
                continue;
            }
            match record(code, fields)? {
                Record::Message { channel, time, data, .. } => {
                    chunk.messages.entry(channel).or_default().push(Message { time, data: end - data.len()..end });
                }
                Record::Channel { id, topic, encoding, metadata } => {
                    chunk.channels.insert(id, Channel { topic, encoding, metadata });
                }
                Record::Metadata { .. } => {}
            }
        }
        chunk.content = content;
        Some(chunk)
    }
}

/// A file that is read in place. It may grow meanwhile: [`Indexed::go_on`].
pub struct Indexed {
    file: File,
    /// Behind the last record that is known.
    at: u64,
    is_whole: bool,
    /// Nothing comes behind.
    is_read: bool,
    pub chunks: Vec<ChunkIndex>,
    /// Channels that are known: of a whole file all.
    pub channels: BTreeMap<u16, Channel>,
    /// Chunks that were looked through for channels.
    looked: usize,
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
}

impl Indexed {
    /// Finds the chunks of a file.
    ///
    /// # Errors
    /// [`Unreadable::NoMcap`] where it begins with anything else, and those of the file.
    pub fn open(file: File) -> Result<Indexed, Unreadable> {
        let mut begin = [0; MAGIC.len()];
        if file.read_exact_at(&mut begin, 0).is_err() || begin != *MAGIC {
            return Err(Unreadable::NoMcap);
        }
        let (chunks, channels, metadata) = Default::default();
        let mut indexed = Indexed { file, at: MAGIC.len() as u64, is_whole: false, is_read: false, chunks, channels, looked: 0, metadata };
        indexed.go_on()?;
        Ok(indexed)
    }

    /// Finds what has come since: of a file that is being written. Whether there was anything.
    pub fn go_on(&mut self) -> Result<bool, Unreadable> {
        let (before, len) = (self.at, self.file.metadata()?.len());
        while !self.is_read {
            match self.step(len) {
                Ok(true) => {}
                // What follows a damaged place cannot be told from damage: the end.
                Ok(false) | Err(Unreadable::Damaged { .. }) => break,
                Err(why) => return Err(why),
            }
        }
        self.find_channels()?;
        Ok(self.at > before)
    }

    /// True where the file's end is there: nothing more comes.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Reads a chunk.
    pub fn chunk(&self, index: usize) -> Result<Chunk, Unreadable> {
        self.unpacked(&self.chunks[index].fields)
    }

    fn unpacked(&self, place: &Range<u64>) -> Result<Chunk, Unreadable> {
        let fields = self.read(place.clone())?;
        let mut content = Vec::new();
        unpack(&fields, place.start, &mut content)?;
        Chunk::of(content).ok_or(Unreadable::Damaged { at: place.start, what: SHORT })
    }

    /// Takes the next record, with the index behind it where it is a chunk's; false where there is no whole one.
    fn step(&mut self, len: u64) -> Result<bool, Unreadable> {
        let Some((code, fields)) = self.head(self.at, len)? else { return Ok(false) };
        let mut end = fields.end;
        match code {
            CHUNK => {
                let head = self.read(fields.start..(fields.start + CHUNK_HEAD).min(fields.end))?;
                let mut rest = Rest(&head);
                let (Some(first), Some(last)) = (rest.u64(), rest.u64()) else { return Err(Unreadable::Damaged { at: self.at, what: SHORT }) };
                let (mut counts, behind, is_whole) = self.index(fields.end, len)?;
                if !is_whole {
                    let chunk = self.unpacked(&fields)?;
                    counts = chunk.messages.iter().map(|(channel, messages)| (*channel, messages.len())).collect();
                }
                end = behind;
                self.chunks.push(ChunkIndex { fields, first, last, counts });
            }
            CHANNEL | METADATA => match record(code, Rest(&self.read(fields)?)) {
                Some(Record::Channel { id, topic, encoding, metadata }) => {
                    self.channels.insert(id, Channel { topic, encoding, metadata });
                }
                Some(Record::Metadata { name, texts }) => {
                    self.metadata.insert(name, texts);
                }
                _ => return Err(Unreadable::Damaged { at: self.at, what: SHORT }),
            },
            DATA_END => self.is_whole = true,
            FOOTER => self.is_read = true,
            _ => {}
        }
        self.at = end;
        Ok(true)
    }

    /// Number of messages of each channel in the index behind a chunk, where it ends, and whether it is whole: the file may end before.
    fn index(&self, mut at: u64, len: u64) -> Result<(BTreeMap<u16, usize>, u64, bool), Unreadable> {
        let mut counts = BTreeMap::new();
        loop {
            match self.head(at, len)? {
                Some((MESSAGE_INDEX, fields)) => {
                    let head = self.read(fields.start..(fields.start + INDEX_HEAD).min(fields.end))?;
                    let mut rest = Rest(&head);
                    if let (Some(channel), Some(bytes)) = (rest.u16(), rest.u32()) {
                        *counts.entry(channel).or_default() += bytes as usize / INDEX_ENTRY;
                    }
                    at = fields.end;
                }
                Some(_) => return Ok((counts, at, true)),
                None => return Ok((counts, at, false)),
            }
        }
    }

    /// Code and fields of the record at a place; nothing where it is not there as a whole.
    fn head(&self, at: u64, len: u64) -> Result<Option<(u8, Range<u64>)>, Unreadable> {
        if at + HEAD > len {
            return Ok(None);
        }
        let head = self.read(at..at + HEAD)?;
        let mut rest = Rest(&head);
        let (Some(code @ 1..), Some(size)) = (rest.u8(), rest.u64()) else { return Ok(None) };
        if size > LEN_MAX {
            return Err(Unreadable::Damaged { at, what: "no record is as long as this one says" });
        }
        let fields = at + HEAD..at + HEAD + size;
        Ok((fields.end <= len).then_some((code, fields)))
    }

    /// Channels of a file without an end stand in its chunks only: those up to the one whose messages name one that is not known.
    fn find_channels(&mut self) -> Result<(), Unreadable> {
        let unknown = |of: &Indexed| of.chunks.iter().rposition(|chunk| chunk.counts.keys().any(|id| !of.channels.contains_key(id)));
        while let Some(last) = unknown(self).filter(|last| *last >= self.looked) {
            for index in self.looked..=last {
                let found = self.chunk(index)?.channels;
                self.channels.extend(found);
            }
            self.looked = last + 1;
        }
        Ok(())
    }

    fn read(&self, place: Range<u64>) -> io::Result<Vec<u8>> {
        let len = usize::try_from(place.end - place.start).map_err(io::Error::other)?;
        let mut bytes = vec![0; len];
        self.file.read_exact_at(&mut bytes, place.start)?;
        Ok(bytes)
    }
}

/// Bytes of a record before its fields: its code and their length.
const HEAD: u64 = 9;
/// Bytes of a chunk before its length: its times.
const CHUNK_HEAD: u64 = 16;
/// Bytes of a message index before its entries: its channel, and their length in bytes.
const INDEX_HEAD: u64 = 6;
/// Bytes of one entry of a message index: time and offset.
const INDEX_ENTRY: usize = 16;
