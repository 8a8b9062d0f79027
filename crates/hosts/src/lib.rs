// SPDX-License-Identifier: Apache-2.0
//! Carries connections, and a supervisor's commands, between hosts over a network.
//!
//! The supervisor's host listens, and the others join it. Zenoh carries packets over TCP or TLS. The sequence numbers, checksums,
//! acknowledgements and retransmissions of the message link in `interconnect` run on top of it. Whatever the network does, a reader
//! receives the newest group and never an older or corrupted one, and every row in order, exactly once; after a partition it resumes by
//! itself.
//!
//! | module | content |
//! |---|---|
//! | `hosts` | listening, joining, and the objects of a host: ends and links |
//! | `bridge`, `bell`, `slots` | the one thread that serves the ends; how real-time threads wake it |
//! | `ends`, `link` | connections; commands |
//! | `outbound`, `inbound` | sending, answering and retransmission; without clock or wire |
//! | `peers`, `control`, `agreement`, `timebase` | the other hosts and their clocks |
//! | `wire`, `session`, `threads`, `faulty` | packets by key: the trait, zenoh, its threads, and a wire with faults for tests |
//! | `options`, `endpoint`, `refused` | options and refusals |
//!
//! Real-time threads never call zenoh, and nothing in this crate waits for a real-time thread.
mod agreement;
mod bell;
mod bridge;
mod control;
mod endpoint;
mod ends;
mod faulty;
mod hosts;
mod inbound;
mod link;
pub mod network;
mod options;
mod outbound;
mod peers;
#[cfg(test)]
mod protocol;
mod random;
mod refused;
mod renewing;
mod secret;
mod session;
mod slots;
mod threads;
mod timebase;

pub use agreement::{ClockOffset, ClockReport};
pub use control::PROTOCOL_VERSION;
pub use faulty::{Faulty, WireFaults};
pub use hosts::{Hosts, TARGET, wire_to_join, wire_to_listen};
pub use options::{ClockWatch, Clocks, Options, Security};
pub use peers::Peer;
pub use refused::JoinError;
pub use secret::secret_of_user;
