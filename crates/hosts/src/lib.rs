// SPDX-License-Identifier: Apache-2.0
//! Hosts: what carries connections, and a supervisor's commands, between hosts over a network.
//!
//! One host listens (the supervisor's), others join it. Zenoh carries packets over TCP or TLS; on top of it are the sequences,
//! checksums, acknowledgements and retransmissions of the message link in `interconnect`, so that a reader gets the newest group and
//! never an older or damaged one, and every row in order, once, whatever the network does, and goes on by itself after a partition.
//!
//! | module | what |
//! |---|---|
//! | `hosts` | listening, joining, and what a host gives: ends and links |
//! | `bridge`, `bell`, `slots` | the one thread that serves the ends; how real-time threads call it |
//! | `ends`, `link` | connections; commands |
//! | `outbound`, `inbound` | what is sent, answered and sent again; without clock or wire |
//! | `peers`, `control`, `agreement`, `timebase` | who is there, what time it is there |
//! | `wire`, `session`, `threads`, `faulty` | packets by key: the trait, zenoh, its threads, and one with faults for tests |
//! | `options`, `endpoint`, `refused` | what is asked for, and what is refused |
//!
//! Nothing of zenoh is called by a real-time thread, and nothing of this crate waits on one.
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
