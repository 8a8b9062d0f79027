// SPDX-License-Identifier: Apache-2.0
//! MCAP files (mcap.dev/spec), written and read. What their messages mean is their writer's.
//!
//! [`Writer`] gathers messages into chunks, each of which reaches the file as a whole: compressed with LZ4, with its checksum and its
//! index; at the end stands the summary by which tools find their way. [`Reader`] gives the records of a file in their order, out of any
//! `Read`, with one chunk in memory at a time; chunks may be compressed with LZ4 or not at all. [`IndexedFile`] reads chunks of a file one by one,
//! wherever they lie, and goes on behind damage.
//!
//! A file whose writer was killed, or whose disk was full, ends without its end. That is no damage: it is read up to its last whole chunk,
//! and [`Reader::is_cut_off`] says so. What cannot be what a writer wrote is [`Unreadable::Damaged`], where [`Reader`] stops: a replay needs
//! every item. [`IndexedFile`] passes over it, and lists it as [`Damage`].
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
