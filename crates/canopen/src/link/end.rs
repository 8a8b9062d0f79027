// SPDX-License-Identifier: Apache-2.0
//! Endpoint of a bus.
use crate::frame::{Came, Frame};
use std::io;
use std::os::fd::OwnedFd;
use std::time::Duration;

/// Prefix of local socket names.
pub const LOCAL: &str = "local:";

/// Returns true if an endpoint receives an identifier; each pair is an identifier and a mask. An endpoint without pairs receives all
/// identifiers.
pub fn hears(heard: &[(u16, u16)], id: u16) -> bool {
    heard.is_empty() || heard.iter().any(|(of, mask)| id & mask == of & mask)
}

/// Endpoint of a bus.
pub trait Link: Send {
    /// Sends a frame. Never blocks or allocates.
    ///
    /// # Errors
    /// Fails if the interface is down or its queue is full.
    fn send(&mut self, frame: &Frame) -> io::Result<()>;

    /// Receives a frame; returns `None` if none has arrived. Never blocks or allocates.
    ///
    /// # Errors
    /// Fails if the interface is down.
    fn receive(&mut self) -> io::Result<Option<Came>>;

    /// Waits until a frame arrives, but at most for this time.
    fn wait(&mut self, time: Duration);

    /// Advances an emulated bus to this time, once all frames sent earlier have been answered. Does nothing on a physical bus.
    ///
    /// # Errors
    /// Fails if the emulated bus has exited.
    fn settle(&mut self, _now_ns: i64) -> io::Result<()> {
        Ok(())
    }

    /// Returns the total number of frames dropped because the queue of the socket was full.
    fn overflowed(&self) -> u32 {
        0
    }

    /// Returns a descriptor to which another process can send frames, 16 bytes each; `None` if the endpoint has none. Allocates.
    fn duplicate(&self) -> Option<OwnedFd> {
        None
    }
}
