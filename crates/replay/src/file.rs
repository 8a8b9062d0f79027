// SPDX-License-Identifier: Apache-2.0
//! Records as files: MCAP, the items one after the other on the channel [`TOPIC`]. Other channels of the file are somebody else's.
//!
//! What is written is MCAP without an index, so that it can be read as far as it goes where the machine went down in the middle.
use crate::recording::Item;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;

/// The channel of a file that items are on.
pub const TOPIC: &str = "opengpac/replay";

/// How its messages are called: items as postcard writes them.
const ENCODING: &str = "opengpac.replay.1";

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0f;

/// No record of a file is longer: what says so is damaged.
const LEN_MAX: u64 = 1 << 32;

/// Writes a record.
pub struct Writer {
    file: BufWriter<File>,
    sequence: u32,
    time_ns: i64,
}

impl Writer {
    /// A new file; one that is there is written over.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create(path: &Path) -> io::Result<Writer> {
        let mut writer = Writer { file: BufWriter::with_capacity(1 << 20, File::create(path)?), sequence: 0, time_ns: 0 };
        writer.file.write_all(&MAGIC)?;
        let mut header = text("");
        header.extend(text(concat!("opengpac ", env!("CARGO_PKG_VERSION"))));
        writer.record(HEADER, &header)?;
        let mut channel = vec![0, 0, 0, 0];
        channel.extend(text(TOPIC));
        channel.extend(text(ENCODING));
        channel.extend(0u32.to_le_bytes());
        writer.record(CHANNEL, &channel)?;
        Ok(writer)
    }

    /// Writes items.
    ///
    /// # Errors
    /// Those of the file system: a full disk.
    pub fn write(&mut self, items: &[Item]) -> io::Result<()> {
        for item in items {
            self.time_ns = item.time_ns().unwrap_or(self.time_ns);
            let mut message = vec![0, 0];
            message.extend(self.sequence.to_le_bytes());
            message.extend(self.time_ns.to_le_bytes());
            message.extend(self.time_ns.to_le_bytes());
            message.extend(item.bytes());
            self.sequence = self.sequence.wrapping_add(1);
            self.record(MESSAGE, &message)?;
        }
        Ok(())
    }

    /// Everything so far is in the file.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn finish(mut self) -> io::Result<()> {
        self.record(DATA_END, &[0; 4])?;
        self.record(FOOTER, &[0; 20])?;
        self.file.write_all(&MAGIC)?;
        self.file.flush()
    }

    fn record(&mut self, kind: u8, content: &[u8]) -> io::Result<()> {
        self.file.write_all(&[kind])?;
        self.file.write_all(&(content.len() as u64).to_le_bytes())?;
        self.file.write_all(content)
    }
}

fn text(of: &str) -> Vec<u8> {
    let mut bytes = (of.len() as u32).to_le_bytes().to_vec();
    bytes.extend(of.as_bytes());
    bytes
}

/// Reads a record.
pub struct Reader {
    file: BufReader<File>,
    /// The chunk that is being read, and how far.
    chunk: io::Cursor<Vec<u8>>,
    channel: Option<u16>,
    is_over: bool,
    /// It ended without saying so.
    pub is_cut_off: bool,
}

impl Reader {
    /// Opens a file.
    ///
    /// # Errors
    /// In words: it is not there, or no MCAP file.
    pub fn open(path: &Path) -> Result<Reader, String> {
        let shown = path.display();
        let mut file = BufReader::with_capacity(1 << 20, File::open(path).map_err(|why| format!("cannot open '{shown}': {why}"))?);
        let mut magic = [0; MAGIC.len()];
        if file.read_exact(&mut magic).is_err() || magic != MAGIC {
            return Err(format!("'{shown}' is no MCAP file: give one that was recorded for replay"));
        }
        Ok(Reader { file, chunk: io::Cursor::default(), channel: None, is_over: false, is_cut_off: false })
    }

    /// The next item; none at the end.
    ///
    /// # Errors
    /// In words: what of the file is damaged.
    pub fn next_item(&mut self) -> Result<Option<Item>, String> {
        while !self.is_over {
            let Some((kind, content)) = self.next_record()? else { break };
            match kind {
                FOOTER | DATA_END => self.is_over = true,
                CHANNEL => {
                    let is_ours = content.get(4..).is_some_and(|rest| rest.starts_with(&text(TOPIC)));
                    if let (true, Some(id)) = (is_ours, word(&content)) {
                        self.channel = Some(id);
                    }
                }
                CHUNK => self.enter(&content)?,
                MESSAGE if self.channel.is_some() && word(&content) == self.channel => {
                    let bytes = content.get(22..).ok_or("a message of the record is too short: the file is damaged")?;
                    return Item::of(bytes).map(Some);
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// True where the file has a channel for replay, as far as it was read.
    pub fn has_items(&self) -> bool {
        self.channel.is_some()
    }

    fn enter(&mut self, content: &[u8]) -> Result<(), String> {
        let damaged = || "a chunk of the file is damaged".to_owned();
        let len = content.get(28..32).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes).ok_or_else(damaged)? as usize;
        let compression = content.get(32..32 + len).ok_or_else(damaged)?;
        if !compression.is_empty() {
            let how = String::from_utf8_lossy(compression);
            return Err(format!("the file is compressed ({how}): decompress it first, for example with 'mcap decompress'"));
        }
        self.chunk = io::Cursor::new(content.get(40 + len..).ok_or_else(damaged)?.to_vec());
        Ok(())
    }

    /// Kind and content of the next record; none where the file is cut off.
    fn next_record(&mut self) -> Result<Option<(u8, Vec<u8>)>, String> {
        if let Some(found) = next_of(&mut self.chunk)? {
            return Ok(Some(found));
        }
        let found = next_of(&mut self.file)?;
        self.is_cut_off = found.is_none();
        Ok(found)
    }
}

fn next_of(from: &mut impl Read) -> Result<Option<(u8, Vec<u8>)>, String> {
    let mut head = [0; 9];
    if from.read_exact(&mut head).is_err() {
        return Ok(None);
    }
    let len = u64::from_le_bytes(head[1..].try_into().map_err(|_| "the file is damaged")?);
    if len > LEN_MAX {
        return Err(format!("a record of the file says that it has {len} bytes: the file is damaged"));
    }
    let mut content = Vec::new();
    let read = from.take(len).read_to_end(&mut content).map_err(|why| format!("the file cannot be read: {why}"))?;
    Ok((read as u64 == len).then_some((head[0], content)))
}

fn word(content: &[u8]) -> Option<u16> {
    Some(u16::from_le_bytes(content.get(..2)?.try_into().ok()?))
}
