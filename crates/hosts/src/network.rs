// SPDX-License-Identifier: Apache-2.0
//! Carrier of packets between hosts: by key, to the subscribers of that key. It may lose, repeat and reorder them; the protocol above
//! makes up for that. The real one is zenoh ([`crate::renewing`]); [`crate::Faulty`] puts faults into any other.
use std::fmt;
use std::sync::Arc;

/// A way between hosts. Never used by a real-time thread.
pub trait Network: Send + Sync {
    /// Returns the outlet for packets of a key.
    ///
    /// # Errors
    /// The way can no longer be used.
    fn outlet(&self, key: &str, urgency: Urgency) -> Result<Box<dyn Outlet>, NetworkError>;

    /// Calls `came` with every packet of a key, on any thread but a real-time one, until the subscription is dropped.
    ///
    /// # Errors
    /// The way can no longer be used.
    fn subscribe(&self, key: &str, came: Arrival) -> Result<Subscription, NetworkError>;
}

/// Function that is called with each packet.
pub type Arrival = Arc<dyn Fn(&[u8]) + Send + Sync>;

/// Ends when it is dropped.
pub type Subscription = Box<dyn Send + Sync>;

/// Outlet for packets of one key.
pub trait Outlet: Send + Sync {
    /// Sends a packet, or loses it: it never waits for the other side.
    fn send(&self, packet: Vec<u8>);
}

/// Order of packets when many wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Urgency {
    /// Pings: what they measure is the way, not the queue.
    Clock,
    /// Groups and rows.
    Values,
    /// Commands, and code modules.
    Commands,
}

/// Reason why a way between hosts cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkError {
    /// Text for people.
    pub message: String,
}

impl fmt::Display for NetworkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for NetworkError {}
