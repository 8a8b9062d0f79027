// SPDX-License-Identifier: Apache-2.0
//! Storage of records in MCAP files: consecutive items on the channel [`TOPIC`], numbered from 0. The recorder writes the whole file, and
//! defines the other channels.
use crate::recording::Item;
use mcap::{Record, Unreadable};
use runtime::trace::Entry;
use std::fs::File;
use std::path::Path;

/// Channel of a file that contains the items.
pub const TOPIC: &str = "/replay";

/// Encoding of the channel's messages: items serialized by postcard.
pub const ENCODING: &str = "opengpac.replay.1";

/// Reader of a record.
pub struct Reader {
    file: mcap::Reader<File>,
    channel: Option<u16>,
    /// Number of the next item.
    next: u32,
}

impl Reader {
    /// Opens a file.
    ///
    /// # Errors
    /// Fails with a message if the file does not exist or is not an MCAP file.
    pub fn open(path: &Path) -> Result<Reader, String> {
        let shown = path.display();
        let file = File::open(path).map_err(|why| format!("cannot open '{shown}': {why}"))?;
        let file = mcap::Reader::new(file).map_err(|why| match why {
            Unreadable::NoMcap => format!("'{shown}' is not an MCAP file: give one that was recorded for replay"),
            why => unreadable(&why),
        })?;
        Ok(Reader { file, channel: None, next: 0 })
    }

    /// Returns the next item, or `None` at the end. If items are missing because the disk was too slow, returns an item that reports
    /// this.
    ///
    /// # Errors
    /// Fails with a message if the file is damaged.
    pub fn next_item(&mut self) -> Result<Option<Item>, String> {
        while let Some(record) = self.file.next_record().map_err(|why| unreadable(&why))? {
            match record {
                Record::Channel { id, topic, .. } if topic == TOPIC => self.channel = Some(id),
                Record::Message { channel, sequence, data, .. } if Some(channel) == self.channel => {
                    let missing = sequence.wrapping_sub(self.next);
                    self.next = sequence.wrapping_add(1);
                    return if missing == 0 { Item::of(data).map(Some) } else { Ok(Some(Item::Entry(Entry::Broken(missed(missing))))) };
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// Returns true if the part of the file read so far has a channel for replay.
    pub fn has_items(&self) -> bool {
        self.channel.is_some()
    }

    /// Returns true if the file lacks its end record.
    pub fn is_cut_off(&self) -> bool {
        self.file.is_cut_off()
    }
}

fn missed(items: u32) -> String {
    format!("{items} of its items are not in the file: the disk was too slow for them")
}

fn unreadable(why: &Unreadable) -> String {
    match why {
        Unreadable::Compressed { how } => format!("the file is compressed ({how}): decompress it first, for example with 'mcap decompress'"),
        why => format!("the file cannot be read: {why}"),
    }
}
