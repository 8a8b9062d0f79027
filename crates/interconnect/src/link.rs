// SPDX-License-Identifier: Apache-2.0
//! The way out of a process: ends of connections that are made one at a time, each where its source runs, and the link between a
//! supervisor and a remote processor.
use crate::carrier::{ConnectionSpec, Receiver, Sender};
use std::fmt;
use std::time::Duration;

/// Carries connections whose ends lie in different processes or on different hosts. Both ends of a connection are made with one number
/// and one [`ConnectionSpec`], in any order, by the owner of the source; a reader that comes later than a publication finds the newest group.
pub trait Ends: Send {
    /// Returns the writing end of connection `number`. Not on the real-time path.
    ///
    /// # Errors
    /// Cause that keeps it from being made: no room, no rights, no way to the other side.
    fn sender(&mut self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError>;

    /// Returns the reading end. `raise` is called once for each row that became readable, on any thread but a real-time one; never for a group.
    /// Not on the real-time path.
    ///
    /// # Errors
    /// As for [`Ends::sender`].
    fn receiver(&mut self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError>;

    /// Connections that were lost since the last call although both ends are there, as where the other side wrote what no end writes. Not on the
    /// real-time path; to be asked now and then.
    fn lost(&mut self) -> Vec<LostConnection> {
        Vec::new()
    }
}

/// A connection over which nothing comes, though both ends are there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LostConnection {
    /// The writing source.
    pub writer: u32,
    /// The reading source.
    pub reader: u32,
    /// Cause of the loss, for people.
    pub message: String,
}

/// Between a supervisor and a remote processor: whole frames, in order, each once, or the link is closed. Used by any thread but a
/// real-time one; one thread receives at a time.
pub trait Link: Send + Sync {
    /// Sends a frame. It may wait for room, but not longer than the link lives.
    ///
    /// # Errors
    /// [`LinkClosed`]: the other side is gone.
    fn send(&self, frame: &[u8]) -> Result<(), LinkClosed>;

    /// Returns the next frame; none if `limit` passed without one.
    ///
    /// # Errors
    /// [`LinkClosed`]: the other side is gone, and everything it had sent has been received.
    fn receive(&self, limit: Duration) -> Result<Option<Vec<u8>>, LinkClosed>;

    /// Closes it: both sides see that.
    fn close(&self);
}

/// Error: an end of a connection could not be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EndError {
    /// Text for people.
    pub message: String,
}

impl fmt::Display for EndError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for EndError {}

/// The other side of a link is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkClosed;

impl fmt::Display for LinkClosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the other side of the link is gone")
    }
}

impl std::error::Error for LinkClosed {}
