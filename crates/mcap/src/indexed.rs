// SPDX-License-Identifier: Apache-2.0
//! Reads an MCAP file in place: the positions of its chunks, and one chunk at a time. Until a chunk is requested, only record headers are
//! read. Unreadable parts are skipped, and listed by [`IndexedFile::damage`].
use crate::Record;
use crate::damage::{BESIDE, Damage, SUMMARY_MAX, Summary, UNLIKELY};
use crate::reader::{LEN_MAX, SHORT, Unreadable, record, unpack};
use crate::records::{CHANNEL, CHUNK, DATA_END, FOOTER, HEADER, MAGIC, MESSAGE, MESSAGE_INDEX, METADATA, Rest};
use crate::sound::{self, HEAD, INDEX_ENTRY};
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

/// A chunk: its position, and its description in the file. Consecutive messages outside chunks are treated as one chunk.
#[derive(Clone, Debug)]
pub struct ChunkIndex {
    /// Position of the chunk's fields in the file; for messages outside chunks, position of their records.
    pub(crate) fields: Range<u64>,
    is_packed: bool,
    /// Earliest and latest time of the chunk's messages, ns.
    pub first: u64,
    pub last: u64,
    /// Number of messages of each channel; channels without messages are omitted.
    pub counts: BTreeMap<u16, usize>,
}

/// A message, stored in the memory of its chunk.
#[derive(Clone, Debug)]
pub struct Message {
    pub time: u64,
    data: Range<usize>,
}

/// A chunk in memory.
#[derive(Debug, Default)]
pub struct Chunk {
    content: Vec<u8>,
    /// Messages by channel, in file order.
    pub messages: BTreeMap<u16, Vec<Message>>,
    /// Channels that the chunk defines.
    pub channels: BTreeMap<u16, Channel>,
}

impl Chunk {
    pub fn data(&self, message: &Message) -> &[u8] {
        &self.content[message.data.clone()]
    }

    /// Returns the earliest and latest time of the chunk's messages, ns.
    fn span(&self) -> Option<(u64, u64)> {
        let times = || self.messages.values().flatten().map(|message| message.time);
        times().min().zip(times().max())
    }

    /// Parses the records of a chunk.
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

/// Index that follows a chunk.
#[derive(Default)]
struct MessageIndex {
    /// Number of messages of each channel.
    counts: BTreeMap<u16, usize>,
    /// Earliest and latest time, if each channel's messages are in chronological order.
    span: Option<(u64, u64)>,
    /// False if the file ends within the index.
    is_whole: bool,
}

/// A file that is read in place. It may grow while it is being read: see [`IndexedFile::go_on`].
pub struct IndexedFile {
    file: File,
    /// Position after the last record read.
    at: u64,
    is_whole: bool,
    /// True if no more records follow.
    is_read: bool,
    pub chunks: Vec<ChunkIndex>,
    /// Known channels; all channels if the file is complete.
    pub channels: BTreeMap<u16, Channel>,
    /// Number of chunks that were searched for channels.
    looked: usize,
    /// Number of complete chunks that the caller has seen.
    seen: usize,
    /// Gaps between intact records that were skipped, in file order.
    passed: Vec<Damage>,
    /// Summary of the file; read when the first damage is found.
    summary: Option<Summary>,
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
}

impl IndexedFile {
    /// Finds the chunks of a file.
    ///
    /// # Errors
    /// Fails with [`Unreadable::NoMcap`] if the file is not an MCAP file, judging by its beginning, and with another error if it cannot be read.
    pub fn open(file: File) -> Result<IndexedFile, Unreadable> {
        let mut begin = [0; MAGIC.len()];
        if file.read_exact_at(&mut begin, 0).is_err() {
            return Err(Unreadable::NoMcap);
        }
        let (chunks, channels, passed, metadata) = Default::default();
        let at = MAGIC.len() as u64;
        let mut indexed = IndexedFile { file, at, is_whole: false, is_read: false, chunks, channels, looked: 0, seen: 0, passed, summary: None, metadata };
        if begin != *MAGIC {
            if !indexed.has_header()? {
                return Err(Unreadable::NoMcap);
            }
            indexed.passed.push(Damage::harmless(0..at, "the magic bytes of the MCAP file are damaged"));
        }
        indexed.go_on()?;
        Ok(indexed)
    }

    /// Reads the part of a growing file added since the last call; returns true if anything was added.
    pub fn go_on(&mut self) -> Result<bool, Unreadable> {
        let (before, len) = (self.at, self.file.metadata()?.len());
        while !self.is_read {
            let what = match self.step(len) {
                Ok(true) => continue,
                Ok(false) => CUT_OFF,
                Err(Unreadable::Damaged { what, .. }) => what,
                Err(why) => return Err(why),
            };
            if !self.pass(what, len)? {
                break;
            }
        }
        self.seen = self.chunks.len();
        self.find_channels()?;
        Ok(self.at > before)
    }

    /// Returns true if the record after the magic is a header record, with which every MCAP file begins.
    fn has_header(&self) -> Result<bool, Unreadable> {
        let Some((HEADER, fields)) = self.head(self.at, self.file.metadata()?.len()).unwrap_or(None) else { return Ok(false) };
        let size = fields.end - fields.start;
        let begin = self.read(fields.start..fields.start + sound::prefix(HEADER, size))?;
        Ok(sound::is_sound(HEADER, &begin, size))
    }

    /// Skips damage up to the next intact record; returns false if none has been written yet.
    fn pass(&mut self, what: &'static str, len: u64) -> Result<bool, Unreadable> {
        if self.at + HEAD > len {
            return Ok(false);
        }
        let summary = self.summary.get_or_insert_with(|| Summary::read(&self.file, len).unwrap_or_default());
        let (known, span) = (summary.places(), summary.span(self.at));
        let next = |has_chunks| sound::next_sound(&self.file, self.at + 1, len, &known, has_chunks);
        let mut found = next(true)?;
        if !self.has_chunks() && !matches!(found, Some((_, CHUNK | MESSAGE_INDEX))) {
            found = next(false)?;
        }
        let Some((to, _)) = found else { return Ok(false) };
        let bytes = self.at..to;
        let fields = (bytes.start + HEAD).min(to)..to;
        let begin = self.read(fields.start..fields.start + sound::prefix(CHUNK, to - fields.start))?;
        let span = span.or_else(|| self.times_at(self.at));
        self.at = to;
        if sound::is_chunk(&begin, fields.end - fields.start) {
            self.passed.push(Damage::harmless(bytes, "the length of a chunk is damaged"));
            self.at = self.take_chunk(fields, len)?;
        } else {
            self.passed.push(Damage { bytes, what: if what == CUT_OFF { UNLIKELY } else { what }, span, counts: None });
        }
        Ok(true)
    }

    /// Returns true if messages are stored in chunks, judging by the part of the file read so far.
    fn has_chunks(&self) -> bool {
        self.chunks.last().is_some_and(|chunk| chunk.is_packed)
    }

    /// Lists the damage found in the file so far. Only the positions of chunks have been checked at that point: [`IndexedFile::chunk`]
    /// checks the content of each, and [`IndexedFile::damage_of`] describes the chunks that it rejects.
    pub fn damage(&self) -> Vec<Damage> {
        let mut found: Vec<Damage> = self.passed.clone();
        let len = self.file.metadata().map_or(self.at, |about| about.len());
        if !self.is_whole && self.at < len {
            found.push(Damage { bytes: self.at..len, what: CUT_OFF, span: self.times_at(self.at), counts: None });
        }
        for damage in found.iter_mut().filter(|damage| damage.span.is_none() && damage.counts.as_ref().is_none_or(|counts| !counts.is_empty())) {
            let before = self.chunks.iter().rfind(|chunk| chunk.fields.end <= damage.bytes.start).map(|chunk| chunk.last);
            let behind = self.chunks.iter().find(|chunk| chunk.fields.start >= damage.bytes.end).map(|chunk| chunk.first);
            damage.span = before.zip(behind).filter(|(from, to)| from <= to);
        }
        found
    }

    /// Describes the loss of a chunk whose content cannot be read.
    pub fn damage_of(&self, chunk: usize, what: &'static str) -> Damage {
        let ChunkIndex { fields, is_packed, first, last, counts } = &self.chunks[chunk];
        let counts = Some(counts.clone()).filter(|counts| !counts.is_empty());
        let begins = if *is_packed { fields.start - HEAD } else { fields.start };
        Damage { bytes: begins..fields.end, what, span: Some((*first, *last)).filter(|(first, last)| first <= last), counts }
    }

    /// Reads the times in the header of a chunk, if the header is present.
    fn times_at(&self, at: u64) -> Option<(u64, u64)> {
        let head = self.read(at..at + HEAD + CHUNK_HEAD).ok()?;
        let mut rest = Rest(&head);
        let (CHUNK, Some(_len)) = (rest.u8()?, rest.u64()) else { return None };
        Some((rest.u64()?, rest.u64()?)).filter(|(first, last)| first <= last)
    }

    /// Returns true if the file has its end record, so that no more records follow.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Reads a chunk.
    pub fn chunk(&self, index: usize) -> Result<Chunk, Unreadable> {
        let ChunkIndex { fields, is_packed, .. } = &self.chunks[index];
        if *is_packed {
            return self.unpacked(fields);
        }
        Chunk::of(self.read(fields.clone())?).ok_or(Unreadable::Damaged { at: fields.start, what: SHORT })
    }

    fn unpacked(&self, place: &Range<u64>) -> Result<Chunk, Unreadable> {
        let fields = self.read(place.clone())?;
        let mut content = Vec::new();
        unpack(&fields, place.start, &mut content)?;
        Chunk::of(content).ok_or(Unreadable::Damaged { at: place.start, what: SHORT })
    }

    /// Reads the next record, and the index after it if it is a chunk; returns false if there are no more complete records.
    fn step(&mut self, len: u64) -> Result<bool, Unreadable> {
        let Some((code, fields)) = self.head(self.at, len)? else { return Ok(false) };
        let (size, mut end) = (fields.end - fields.start, fields.end);
        let begin = self.read(fields.start..fields.start + sound::prefix(code, size))?;
        let Some(meant) = sound::code_of(code, &begin, size, self.has_chunks()) else { return Err(Unreadable::Damaged { at: self.at, what: SHORT }) };
        if meant != code {
            self.passed.push(Damage::harmless(self.at..fields.start, "the opcode of a record is damaged"));
        }
        // This may be a chunk whose code and length are both damaged: its own content does not show that, but the record after it does.
        if self.has_chunks() && sound::is_vague(meant) && end + HEAD <= len && !sound::is_record(&self.file, end, len, 0)? {
            return Err(Unreadable::Damaged { at: self.at, what: UNLIKELY });
        }
        match meant {
            CHUNK => end = self.take_chunk(fields, len)?,
            // This is an entry of the summary whose code is damaged.
            MESSAGE if self.is_whole => self.passed.push(Damage::harmless(self.at..end, "the opcode of a record is damaged")),
            // Such a record cannot be distinguished from an index whose code and length are damaged, and it has no checksum. No known
            // writer mixes both.
            MESSAGE if self.has_chunks() => self.passed.push(Damage { bytes: self.at..end, what: BESIDE, span: None, counts: None }),
            MESSAGE => self.take_message(&begin, fields),
            // The index belongs to a chunk that was skipped.
            MESSAGE_INDEX => {
                let (MessageIndex { counts, .. }, behind) = self.index(self.at, len)?;
                let is_chunk = |place: &Range<u64>| self.summary.as_ref().is_some_and(|summary| summary.is_chunk(place));
                let is_one = |damage: &&mut Damage| damage.counts.is_none() && damage.bytes.end == self.at && is_chunk(&damage.bytes);
                if let Some(damage) = self.passed.last_mut().filter(is_one) {
                    damage.counts = Some(counts);
                }
                end = behind;
            }
            CHANNEL | METADATA => match record(meant, Rest(&self.read(fields)?)) {
                Some(Record::Channel { id, topic, encoding, metadata }) => {
                    self.channels.insert(id, Channel { topic, encoding, metadata });
                }
                Some(Record::Metadata { name, texts }) => {
                    self.metadata.insert(name, texts);
                }
                _ => return Err(Unreadable::Damaged { at: self.at, what: SHORT }),
            },
            DATA_END => self.is_whole = true,
            FOOTER => {
                (self.is_whole, self.is_read) = (true, true);
                self.check_summary(fields)?;
            }
            _ => {}
        }
        self.at = end;
        Ok(true)
    }

    /// Discards the channels read from a summary if its checksum differs from that in the footer. Chunks have their own checksums.
    fn check_summary(&mut self, footer: Range<u64>) -> Result<(), Unreadable> {
        let fields = self.read(footer.clone())?;
        let mut rest = Rest(&fields);
        let (Some(begins), Some(_offsets), Some(sum @ 1..)) = (rest.u64(), rest.u64(), rest.u32()) else { return Ok(()) };
        let ends = footer.end - size_of::<u32>() as u64;
        if begins < MAGIC.len() as u64 || begins > footer.start || footer.start - begins > SUMMARY_MAX {
            self.passed.push(Damage::harmless(footer, "the end of the file is damaged"));
        } else if crc32fast::hash(&self.read(begins..ends)?) != sum {
            self.passed.push(Damage::harmless(begins..ends, "the checksum of the summary does not match"));
        } else {
            return Ok(());
        }
        let described = std::mem::take(&mut self.channels);
        for index in 0..self.chunks.len() {
            match self.chunk(index) {
                Ok(chunk) => self.channels.extend(chunk.channels),
                Err(Unreadable::Damaged { .. }) => {}
                Err(why) => return Err(why),
            }
        }
        for (id, channel) in described {
            self.channels.entry(id).or_insert(channel);
        }
        Ok(())
    }

    /// Adds a chunk; returns the end of the index after it.
    fn take_chunk(&mut self, fields: Range<u64>, len: u64) -> Result<u64, Unreadable> {
        let head = self.read(fields.start..fields.start + CHUNK_HEAD)?;
        let mut rest = Rest(&head);
        let (Some(mut first), Some(mut last)) = (rest.u64(), rest.u64()) else { return Err(Unreadable::Damaged { at: self.at, what: SHORT }) };
        let (MessageIndex { mut counts, span, is_whole }, behind) = self.index(fields.end, len)?;
        // The times in its head have no checksum; those of its messages have one.
        if !is_whole || span.is_some_and(|span| span != (first, last)) {
            match self.unpacked(&fields) {
                Ok(chunk) => {
                    counts = chunk.messages.iter().map(|(channel, messages)| (*channel, messages.len())).collect();
                    if let Some(span) = chunk.span().filter(|span| *span != (first, last)) {
                        if (first, last) != UNSAID {
                            self.passed.push(Damage::harmless(fields.start..fields.start + CHUNK_HEAD, "the times in the header of a chunk are damaged"));
                        }
                        (first, last) = span;
                    }
                }
                Err(Unreadable::Damaged { .. }) => {}
                Err(why) => return Err(why),
            }
        }
        self.chunks.push(ChunkIndex { fields, is_packed: true, first, last, counts });
        Ok(behind)
    }

    /// Adds a message that is not in a chunk.
    fn take_message(&mut self, begin: &[u8], fields: Range<u64>) {
        let mut rest = Rest(begin);
        let (Some(channel), Some(_sequence), Some(time)) = (rest.u16(), rest.u32(), rest.u64()) else { return };
        let is_free = self.chunks.len() > self.seen;
        let run = self.chunks.last_mut().filter(|run| is_free && !run.is_packed && run.fields.end == self.at && self.at - run.fields.start < RUN_MAX);
        if let Some(run) = run {
            run.fields.end = fields.end;
            (run.first, run.last) = (run.first.min(time), run.last.max(time));
            *run.counts.entry(channel).or_default() += 1;
        } else {
            self.chunks.push(ChunkIndex { fields: self.at..fields.end, is_packed: false, first: time, last: time, counts: [(channel, 1)].into() });
        }
    }

    /// Reads the index after a chunk; returns the index and the offset of its end.
    fn index(&self, mut at: u64, len: u64) -> Result<(MessageIndex, u64), Unreadable> {
        let mut found = MessageIndex::default();
        loop {
            let (code, fields) = match self.head(at, len) {
                Ok(Some(found)) => found,
                Ok(None) | Err(Unreadable::Damaged { .. }) => return Ok((found, at)),
                Err(why) => return Err(why),
            };
            let size = fields.end - fields.start;
            let begin = self.read(fields.start..fields.start + sound::prefix(code, size))?;
            match sound::code_of(code, &begin, size, true) {
                Some(MESSAGE_INDEX) => {}
                meant => return Ok((MessageIndex { is_whole: meant.is_some(), ..found }, at)),
            }
            let mut rest = Rest(&begin);
            if let (Some(channel), Some(bytes)) = (rest.u16(), rest.u32()) {
                *found.counts.entry(channel).or_default() += bytes as usize / INDEX_ENTRY;
            }
            if let Some(first) = rest.u64() {
                let mut last = [0; 8];
                self.file.read_exact_at(&mut last, fields.end - INDEX_ENTRY as u64)?;
                let last = u64::from_le_bytes(last);
                found.span = Some(found.span.map_or((first, last), |(from, to)| (from.min(first), to.max(last))));
            }
            at = fields.end;
        }
    }

    /// Returns the opcode and fields of the record at an offset, or `None` if it is incomplete.
    fn head(&self, at: u64, len: u64) -> Result<Option<(u8, Range<u64>)>, Unreadable> {
        if at + HEAD > len {
            return Ok(None);
        }
        let head = self.read(at..at + HEAD)?;
        let mut rest = Rest(&head);
        let (Some(code @ 1..), Some(size)) = (rest.u8(), rest.u64()) else { return Ok(None) };
        if size > LEN_MAX {
            return Err(Unreadable::Damaged { at, what: "a record has an impossible length" });
        }
        let fields = at + HEAD..at + HEAD + size;
        Ok((fields.end <= len).then_some((code, fields)))
    }

    /// Finds the channels of a file without an end record. They are defined only in its chunks, which are searched from the first to the
    /// last one whose messages refer to an unknown channel.
    fn find_channels(&mut self) -> Result<(), Unreadable> {
        let unknown = |of: &IndexedFile| of.chunks.iter().rposition(|chunk| chunk.counts.keys().any(|id| !of.channels.contains_key(id)));
        while let Some(last) = unknown(self).filter(|last| *last >= self.looked) {
            for index in self.looked..=last {
                match self.chunk(index) {
                    Ok(chunk) => self.channels.extend(chunk.channels),
                    // The chunk's channels may be described in the summary.
                    Err(Unreadable::Damaged { .. }) => {}
                    Err(why) => return Err(why),
                }
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

/// Size of the part of a chunk that precedes its length and contains its times, bytes.
const CHUNK_HEAD: u64 = 16;
/// Times in a chunk header whose writer left them out.
const UNSAID: (u64, u64) = (0, 0);
/// Maximum size of consecutive messages outside chunks that are treated as one chunk, bytes.
const RUN_MAX: u64 = 1 << 20;
const CUT_OFF: &str = "the file ends within a record";
