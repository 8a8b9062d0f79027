// SPDX-License-Identifier: Apache-2.0
//! Carrier of packets between hosts: delivers them by key to that key's subscribers. It may lose, repeat and reorder them; the protocol
//! on top of it compensates for that. In production, the carrier is zenoh ([`crate::renewing`]); [`crate::Faulty`] adds faults to any
//! carrier.
use std::fmt;
use std::sync::Arc;

/// A connection between hosts. Real-time threads never use it.
pub trait Network: Send + Sync {
    /// Returns the outlet for packets of a key.
    ///
    /// # Errors
    /// Fails if the connection can no longer be used.
    fn outlet(&self, key: &str, urgency: Urgency) -> Result<Box<dyn Outlet>, NetworkError>;

    /// Calls `came` with every packet of a key, on any non-real-time thread, until the subscription is dropped.
    ///
    /// # Errors
    /// Fails if the connection can no longer be used.
    fn subscribe(&self, key: &str, came: Arrival) -> Result<Subscription, NetworkError>;

    /// Notifies the carrier that the listening side has answered a packet of this one, so packets pass in both directions. A carrier that
    /// is not notified for several seconds may reconnect.
    fn answered(&self) {}
}

/// Function that is called with each packet.
pub type Arrival = Arc<dyn Fn(&[u8]) + Send + Sync>;

/// A subscription, which ends when it is dropped.
pub type Subscription = Box<dyn Send + Sync>;

/// Outlet for packets of one key.
pub trait Outlet: Send + Sync {
    /// Sends a packet, or drops it. Never waits for the other side.
    fn send(&self, packet: Vec<u8>);
}

/// Priority of packets when many are pending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Urgency {
    /// Pings, which must measure the network rather than the queue.
    Clock,
    /// Groups and rows.
    Values,
    /// Commands, and code modules.
    Commands,
}

/// Reason why a connection between hosts cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkError {
    /// Human-readable message.
    pub message: String,
}

impl fmt::Display for NetworkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for NetworkError {}
