// SPDX-License-Identifier: Apache-2.0
//! The interconnect: carries values between interrupt sources, and to the programming system and the recorder.
//!
//! There is one connection for each pair (writing source → reading source). Its asynchronous members, the *group*, are carried by a
//! triple buffer, its synchronous and ratio members by a queue of rows, taken by number. The programming system and the recorder read
//! from a ring of rows. No interrupt source ever blocks, retries or spins here.
//!
//! | module | carries | writer | reader |
//! |---|---|---|---|
//! | [`triple`] | the newest group | one, wait-free | one, wait-free |
//! | [`mod@queue`] | every row, in order, once | one, wait-free | one, wait-free |
//! | [`mod@rows`] | the last rows | one, wait-free | any number; they retry when overtaken |
//!
//! A [`Carrier`] makes connections from these: [`Memory`] between threads, [`Message`] over a link that can delay, drop, repeat, reorder
//! and corrupt, for tests under the virtual clock. [`Ends`] makes the two ends of a connection separately, in different processes or on
//! different hosts. Blocks, graphs and verbs cannot tell the difference. [`message::ends`] and [`message::packet`] are the protocol of
//! the message link without its timing; crate `hosts` uses it over a network.
//!
//! ```
//! use interconnect::{Carrier, ConnectionSpec, Memory};
//!
//! let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 8, queue_row_len: 8, queue_depth: 2 };
//! let (mut sender, mut receiver) = Memory.connect(&spec);
//! // at the end of the writer's firing 7, released at 7 ms
//! sender.group().copy_from_slice(&1.5f64.to_ne_bytes());
//! sender.publish(7, 7_000_000);
//! sender.push(7, 7_000_000, &mut |row| row.copy_from_slice(&2.5f64.to_ne_bytes()))?;
//! // at the start of the reader's next firing
//! let header = receiver.latch(8_000_000).expect("there is news");
//! assert_eq!((header.number, header.age_ns(8_000_000)), (7, 1_000_000));
//! assert_eq!(receiver.group(), 1.5f64.to_ne_bytes());
//! assert_eq!(receiver.peek_row(), Some((7, 2.5f64.to_ne_bytes().as_slice())));
//! assert!(receiver.pop_row());
//! # Ok::<(), interconnect::Full>(())
//! ```
//!
//! This crate knows bytes and numbers, but no types, blocks, verbs, clocks, files or networks.
mod ahead;
mod aligned;
pub mod carrier;
pub mod conformance;
pub mod link;
pub mod memory;
pub mod message;
pub mod queue;
pub mod rows;
mod sync;
pub mod triple;

pub use carrier::{Carrier, ConnectionSpec, Full, Header, Receiver, Sender};
pub use link::{EndError, Ends, Link, LinkClosed, LostConnection};
pub use memory::Memory;
pub use message::{Counters, Faults, Message};
pub use queue::{QueueMemory, QueueReader, QueueWriter, queue};
pub use rows::{Row, RowSink, RowsReader, RowsWriter, rows};
pub use triple::{TripleMemory, TripleReader, TripleWriter, triple_buffer};
