// SPDX-License-Identifier: Apache-2.0
//! Connections between processes: ends that are created one at a time, each where its source runs, and the link between a supervisor and
//! a remote processor.
use crate::carrier::{ConnectionSpec, Receiver, Sender};
use std::fmt;
use std::time::Duration;

/// Factory for connections whose ends are in different processes or on different hosts. The owner of each source creates its end, in any
/// order, from the connection's number and [`ConnectionSpec`]; a reader created after a publication receives the newest group.
pub trait Ends: Send {
    /// Returns the writing end of connection `number`. Not on the real-time path.
    ///
    /// # Errors
    /// Fails if the end cannot be created, for example because of lack of space, insufficient privileges or an unreachable peer.
    fn sender(&mut self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError>;

    /// Returns the reading end. `raise` is called once for each row that became readable, on any thread except a real-time one; it is
    /// never called for a group. Not on the real-time path.
    ///
    /// # Errors
    /// Same as for [`Ends::sender`].
    fn receiver(&mut self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError>;

    /// Returns the connections that were lost since the last call although both ends exist, for example because the other side wrote
    /// values that no end would write. Should be polled regularly. Not on the real-time path.
    fn lost(&mut self) -> Vec<LostConnection> {
        Vec::new()
    }
}

/// A connection that no longer carries data, although both ends exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LostConnection {
    /// Writing source.
    pub writer: u32,
    /// Reading source.
    pub reader: u32,
    /// Cause of the loss, human-readable.
    pub message: String,
}

/// Link between a supervisor and a remote processor: until it is closed, delivers whole frames, in order, each exactly once. Used by any
/// thread except a real-time one; only one thread may receive at a time.
pub trait Link: Send + Sync {
    /// Sends a frame. May block until there is room; fails as soon as the link is closed.
    ///
    /// # Errors
    /// [`LinkClosed`] if the other side has disconnected.
    fn send(&self, frame: &[u8]) -> Result<(), LinkClosed>;

    /// Returns the next frame; `None` if none arrived within `limit`.
    ///
    /// # Errors
    /// [`LinkClosed`] if the other side has disconnected and everything it sent has been received.
    fn receive(&self, limit: Duration) -> Result<Option<Vec<u8>>, LinkClosed>;

    /// Closes the link for both sides.
    fn close(&self);
}

/// Error: an end of a connection could not be created.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EndError {
    /// Human-readable message.
    pub message: String,
}

impl fmt::Display for EndError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for EndError {}

/// Error: the other side of a link has disconnected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkClosed;

impl fmt::Display for LinkClosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the other side of the link is gone")
    }
}

impl std::error::Error for LinkClosed {}
