// SPDX-License-Identifier: Apache-2.0
//! Reads and writes MCAP files (mcap.dev/spec). The meaning of the messages is left to their writer.
//!
//! [`Writer`] gathers messages into chunks, each of which reaches the file as a whole: compressed with LZ4, with its checksum and its
//! index. The summary at the end lets tools find the chunks. [`Reader`] returns the records of a file in order, from any `Read`, with one
//! chunk in memory at a time; chunks may be compressed with LZ4 or uncompressed. [`IndexedFile`] reads individual chunks of a file in any
//! order, and continues after damage.
//!
//! A file whose writer was killed, or whose disk was full, lacks its end record. This does not count as damage: the file is read up to
//! its last complete chunk, and [`Reader::is_cut_off`] returns true. Bytes that a writer cannot have written are reported as
//! [`Unreadable::Damaged`], at which [`Reader`] stops, because a replay needs every item. [`IndexedFile`] skips them, and lists them as
//! [`Damage`].
mod damage;
#[cfg(test)]
mod damaged;
mod indexed;
mod reader;
mod records;
mod sound;
#[cfg(test)]
mod tests;
mod writer;

pub use damage::Damage;
pub use indexed::{Channel, Chunk, ChunkIndex, IndexedFile, Message};
pub use reader::{Reader, Record, Unreadable};
pub use writer::{Schema, Writer};
