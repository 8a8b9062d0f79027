// SPDX-License-Identifier: Apache-2.0
//! Reads the records of an MCAP file one after another, including those in chunks.
use crate::records::{CHANNEL, CHUNK, DATA_END, FOOTER, MAGIC, MESSAGE, METADATA, NONE, Rest};
use std::collections::BTreeMap;
use std::io::{self, BufReader, Read};
use std::ops::Range;

/// A record with content. Indexes, schemas and attachments are skipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Record<'a> {
    /// Channel to which subsequent messages with this `id` belong. A channel may be repeated.
    Channel {
        id: u16,
        topic: String,
        encoding: String,
        metadata: BTreeMap<String, String>,
    },
    /// A message; `time` is in ns.
    Message {
        channel: u16,
        sequence: u32,
        time: u64,
        data: &'a [u8],
    },
    Metadata {
        name: String,
        texts: BTreeMap<String, String>,
    },
}

/// Reason why a file cannot be read, or cannot be read further.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    #[error("it is not an MCAP file")]
    NoMcap,
    /// The record at byte offset `at` is damaged.
    #[error("it is damaged at byte {at}: {what}")]
    Damaged { at: u64, what: &'static str },
    #[error("it is compressed with '{how}'")]
    Compressed { how: String },
    #[error(transparent)]
    File(#[from] io::Error),
}

/// Reads an MCAP file from `R`, which need not be buffered.
pub struct Reader<R> {
    source: BufReader<R>,
    /// Offsets of the start and end of the record being read.
    begins: u64,
    ends: u64,
    /// Compressed bytes of the chunk that is being decompressed.
    packed: Vec<u8>,
    /// Records of the current chunk, or the fields of a record outside chunks, and the read position.
    content: Vec<u8>,
    taken: usize,
    state: State,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Reading,
    Whole,
    CutOff,
    Failed,
}

impl<R: Read> Reader<R> {
    /// Creates a reader.
    ///
    /// # Errors
    /// Fails with [`Unreadable::NoMcap`] if the source does not begin with the magic bytes of an MCAP file, and with another error if it cannot be read.
    pub fn new(source: R) -> Result<Reader<R>, Unreadable> {
        let mut reader = Reader {
            source: BufReader::with_capacity(BUFFER, source),
            begins: 0,
            ends: MAGIC.len() as u64,
            packed: Vec::new(),
            content: Vec::new(),
            taken: 0,
            state: State::Reading,
        };
        let is_whole = fill(&mut reader.source, MAGIC.len() as u64, &mut reader.packed)?;
        if is_whole && reader.packed == MAGIC { Ok(reader) } else { Err(Unreadable::NoMcap) }
    }

    /// Returns the next record, or `None` at the end of the data, even if the file is cut off there.
    ///
    /// # Errors
    /// Fails if the file cannot be read further; no records follow an error.
    pub fn next_record(&mut self) -> Result<Option<Record<'_>>, Unreadable> {
        let found = self.find();
        if found.is_err() {
            self.state = State::Failed;
        }
        let Some((code, place)) = found? else { return Ok(None) };
        match record(code, Rest(&self.content[place])) {
            Some(record) => Ok(Some(record)),
            None => {
                self.state = State::Failed;
                Err(Unreadable::Damaged { at: self.begins, what: SHORT })
            }
        }
    }

    /// Returns true after the last record of a file that has its end record.
    pub fn is_whole(&self) -> bool {
        self.state == State::Whole
    }

    /// Returns true after the last complete record of a file that lacks its end record because its writer was interrupted.
    pub fn is_cut_off(&self) -> bool {
        self.state == State::CutOff
    }

    /// Returns the opcode of the next record that has content, and its position in `content`.
    fn find(&mut self) -> Result<Option<(u8, Range<usize>)>, Unreadable> {
        while self.state == State::Reading {
            if self.taken < self.content.len() {
                let mut rest = Rest(&self.content[self.taken..]);
                let (code, fields) = rest.record().ok_or(Unreadable::Damaged { at: self.begins, what: SHORT })?;
                let end = self.content.len() - rest.0.len();
                self.taken = end;
                match code {
                    CHANNEL | MESSAGE => return Ok(Some((code, end - fields.0.len()..end))),
                    NONE | CHUNK | DATA_END | FOOTER => return Err(Unreadable::Damaged { at: self.begins, what: "a chunk contains an impossible record" }),
                    _ => continue,
                }
            }
            let Some((code, len)) = self.head()? else { break };
            match code {
                DATA_END | FOOTER => self.state = if self.pass(len)? { State::Whole } else { State::CutOff },
                CHUNK => self.enter(len)?,
                CHANNEL | MESSAGE | METADATA => {
                    let is_whole = fill(&mut self.source, len, &mut self.content)?;
                    self.taken = self.content.len();
                    if is_whole {
                        return Ok(Some((code, 0..self.taken)));
                    }
                    self.state = State::CutOff;
                }
                _ if self.pass(len)? => {}
                _ => self.state = State::CutOff,
            }
        }
        Ok(None)
    }

    /// Returns the opcode and length of the next record outside chunks, or `None` if the file is cut off.
    fn head(&mut self) -> Result<Option<(u8, u64)>, Unreadable> {
        self.begins = self.ends;
        let is_whole = fill(&mut self.source, HEAD, &mut self.packed)?;
        let mut head = Rest(&self.packed);
        // No record begins with 0: this is space that a file system has allocated and that was never written.
        let (true, Some(code @ 1..), Some(len)) = (is_whole, head.u8(), head.u64()) else {
            self.state = State::CutOff;
            return Ok(None);
        };
        if len > LEN_MAX {
            return Err(Unreadable::Damaged { at: self.begins, what: "a record has an impossible length" });
        }
        self.ends = self.begins + HEAD + len;
        Ok(Some((code, len)))
    }

    /// Skips the fields of a record; returns false if the file is cut off.
    fn pass(&mut self, len: u64) -> io::Result<bool> {
        Ok(io::copy(&mut (&mut self.source).take(len), &mut io::sink())? == len)
    }

    /// Continues with the records of a chunk.
    fn enter(&mut self, len: u64) -> Result<(), Unreadable> {
        self.content.clear();
        self.taken = 0;
        if !fill(&mut self.source, len, &mut self.packed)? {
            self.state = State::CutOff;
            return Ok(());
        }
        unpack(&self.packed, self.begins, &mut self.content)
    }
}

/// Decompresses the records of a chunk with these fields into `content`, which is empty. `at` is the offset of the chunk in the file.
pub(crate) fn unpack(fields: &[u8], at: u64, content: &mut Vec<u8>) -> Result<(), Unreadable> {
    let damaged = |what| Unreadable::Damaged { at, what };
    let (size, sum, compression, packed) = chunk(Rest(fields)).ok_or_else(|| damaged(SHORT))?;
    match compression.as_str() {
        "" => content.extend(packed),
        "lz4" if size <= LEN_MAX => {
            // Reading one byte more includes the end mark.
            let read = lz4_flex::frame::FrameDecoder::new(packed).take(size + 1).read_to_end(content);
            read.map_err(|_| damaged("a chunk cannot be decompressed"))?;
        }
        "lz4" => return Err(damaged("a chunk has an impossible length")),
        "zstd" => return Err(Unreadable::Compressed { how: compression }),
        _ => return Err(damaged("a chunk specifies a compression that MCAP does not define")),
    }
    if content.len() as u64 != size {
        return Err(damaged("the length of a chunk does not match its content"));
    }
    if sum != 0 && crc32fast::hash(content) != sum {
        return Err(damaged("the checksum of a chunk does not match"));
    }
    Ok(())
}

/// Size of a record header, bytes: its opcode and the length of its fields.
const HEAD: u64 = 9;

/// Maximum length of a record or chunk; a larger value is damage.
pub(crate) const LEN_MAX: u64 = 1 << 32;

const BUFFER: usize = 1 << 16;

pub(crate) const SHORT: &str = "a record is shorter than its fields";

/// Reads `len` bytes; returns false if the source ends first. Memory is allocated only for bytes that exist, regardless of `len`.
fn fill(source: &mut impl Read, len: u64, into: &mut Vec<u8>) -> io::Result<bool> {
    into.clear();
    Ok(source.take(len).read_to_end(into)? as u64 == len)
}

/// Returns the length and checksum of a chunk's records, their compression, and the compressed bytes; `None` if the chunk is too short.
fn chunk(mut fields: Rest<'_>) -> Option<(u64, u32, String, &[u8])> {
    let (_first, _last, size, sum, compression, len) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?, fields.text()?, fields.u64()?);
    Some((size, sum, compression, fields.take(usize::try_from(len).ok()?)?))
}

/// Parses a record; returns `None` if its fields are too short.
pub(crate) fn record(code: u8, mut fields: Rest<'_>) -> Option<Record<'_>> {
    Some(match code {
        CHANNEL => {
            let (id, _schema) = (fields.u16()?, fields.u16()?);
            Record::Channel { id, topic: fields.text()?, encoding: fields.text()?, metadata: fields.texts()? }
        }
        MESSAGE => {
            let (channel, sequence, time, _published) = (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
            Record::Message { channel, sequence, time, data: fields.0 }
        }
        _ => Record::Metadata { name: fields.text()?, texts: fields.texts()? },
    })
}
