// SPDX-License-Identifier: Apache-2.0
//! Records as files: MCAP, the items one after the other on the channel [`TOPIC`]. Other channels of the file are somebody else's.
use crate::recording::Item;
use mcap::{Record, Unreadable};
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::Path;

/// The channel of a file that items are on.
pub const TOPIC: &str = "opengpac/replay";

/// How its messages are called: items as postcard writes them.
const ENCODING: &str = "opengpac.replay.1";

/// Writes a record.
pub struct Writer {
    file: mcap::Writer<File>,
    channel: u16,
    sequence: u32,
    time_ns: u64,
}

impl Writer {
    /// A new file; one that is there is written over.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create(path: &Path) -> io::Result<Writer> {
        let mut file = mcap::Writer::new(File::create(path)?, concat!("opengpac ", env!("CARGO_PKG_VERSION")))?;
        let channel = file.channel(TOPIC, ENCODING, None, &BTreeMap::new()).expect("a new file has numbers for channels");
        // However soon its writer is stopped, it is a record.
        file.finish_chunk()?;
        Ok(Writer { file, channel, sequence: 0, time_ns: 0 })
    }

    /// Writes items; those of a chunk that is not full yet reach the file with the next `flush`.
    ///
    /// # Errors
    /// Those of the file system: a full disk.
    pub fn write(&mut self, items: &[Item]) -> io::Result<()> {
        for item in items {
            if let Some(time_ns) = item.time_ns() {
                self.time_ns = u64::try_from(time_ns).unwrap_or(0);
            }
            self.file.put(self.channel, self.sequence, self.time_ns, &item.bytes());
            self.sequence = self.sequence.wrapping_add(1);
            if self.file.is_full() {
                self.file.finish_chunk()?;
            }
        }
        Ok(())
    }

    /// Everything so far is in the file, and can be read whatever happens to this process. Makes a chunk of it: what is flushed too often
    /// is compressed badly.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn flush(&mut self) -> io::Result<()> {
        self.file.finish_chunk()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn finish(mut self) -> io::Result<()> {
        self.file.finish()
    }
}

/// Reads a record.
pub struct Reader {
    file: mcap::Reader<File>,
    channel: Option<u16>,
}

impl Reader {
    /// Opens a file.
    ///
    /// # Errors
    /// In words: it is not there, or no MCAP file.
    pub fn open(path: &Path) -> Result<Reader, String> {
        let shown = path.display();
        let file = File::open(path).map_err(|why| format!("cannot open '{shown}': {why}"))?;
        let file = mcap::Reader::new(file).map_err(|why| match why {
            Unreadable::NoMcap => format!("'{shown}' is no MCAP file: give one that was recorded for replay"),
            why => unreadable(&why),
        })?;
        Ok(Reader { file, channel: None })
    }

    /// The next item; none at the end.
    ///
    /// # Errors
    /// In words: what of the file is damaged.
    pub fn next_item(&mut self) -> Result<Option<Item>, String> {
        while let Some(record) = self.file.next_record().map_err(|why| unreadable(&why))? {
            match record {
                Record::Channel { id, topic, .. } if topic == TOPIC => self.channel = Some(id),
                Record::Message { channel, data, .. } if Some(channel) == self.channel => return Item::of(data).map(Some),
                _ => {}
            }
        }
        Ok(None)
    }

    /// True where the file has a channel for replay, as far as it was read.
    pub fn has_items(&self) -> bool {
        self.channel.is_some()
    }

    /// It ended without saying so.
    pub fn is_cut_off(&self) -> bool {
        self.file.is_cut_off()
    }
}

fn unreadable(why: &Unreadable) -> String {
    match why {
        Unreadable::Compressed { how } => format!("the file is compressed ({how}): decompress it first, for example with 'mcap decompress'"),
        why => format!("the file cannot be read: {why}"),
    }
}
