// SPDX-License-Identifier: Apache-2.0
//! End of a bus.
use crate::frame::{Came, Frame};
use std::io;
use std::os::fd::OwnedFd;
use std::time::Duration;

/// Prefix of the name of a local socket.
pub const LOCAL: &str = "local:";

/// Returns true if an end receives an identifier: each pair is an identifier and a mask. An end without pairs receives all.
pub fn hears(heard: &[(u16, u16)], id: u16) -> bool {
    heard.is_empty() || heard.iter().any(|(of, mask)| id & mask == of & mask)
}

/// One end of a bus.
pub trait Link: Send {
    /// Sends a frame. It never waits and never allocates.
    ///
    /// # Errors
    /// Fails if the interface is down, or its queue is full.
    fn send(&mut self, frame: &Frame) -> io::Result<()>;

    /// Receives a frame, or returns `None` if none has arrived. It never waits and never allocates.
    ///
    /// # Errors
    /// Fails if the interface is down.
    fn receive(&mut self) -> io::Result<Option<Came>>;

    /// Waits until a frame arrives, or for this time.
    fn wait(&mut self, time: Duration);

    /// Advances an emulated bus to this time, when everything sent before has been answered. A physical bus does so by itself.
    ///
    /// # Errors
    /// Fails if the emulated bus has exited.
    fn settle(&mut self, _now_ns: i64) -> io::Result<()> {
        Ok(())
    }

    /// Returns the total number of frames for which the queue of the socket had no room.
    fn overflowed(&self) -> u32 {
        0
    }

    /// Returns a descriptor to which another process can send frames, 16 bytes each, or `None` if there is none. It allocates.
    fn duplicate(&self) -> Option<OwnedFd> {
        None
    }
}
