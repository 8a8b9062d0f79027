// SPDX-License-Identifier: Apache-2.0
//! End of a bus.
use crate::frame::{Came, Frame};
use std::io;
use std::os::fd::OwnedFd;
use std::time::Duration;

/// Prefix of the name of a local socket.
pub const LOCAL: &str = "local:";

/// Returns true if an end hears an identifier: each pair is one with the bits that count of it; none: it hears all.
pub fn hears(heard: &[(u16, u16)], id: u16) -> bool {
    heard.is_empty() || heard.iter().any(|(of, mask)| id & mask == of & mask)
}

/// One end of a bus.
pub trait Link: Send {
    /// Sends a frame. It never waits and never allocates.
    ///
    /// # Errors
    /// The interface is down, or its queue is full.
    fn send(&mut self, frame: &Frame) -> io::Result<()>;

    /// Receives what is there; none: nothing is. It never waits and never allocates.
    ///
    /// # Errors
    /// The interface is down.
    fn receive(&mut self) -> io::Result<Option<Came>>;

    /// Waits until something is there, or for this time.
    fn wait(&mut self, time: Duration);

    /// Brings an emulated bus to this time, with everything answered that was sent before. A bus of copper does so by itself.
    ///
    /// # Errors
    /// The emulated bus is gone.
    fn settle(&mut self, _now_ns: i64) -> io::Result<()> {
        Ok(())
    }

    /// Frames that came and that the queue of the socket had no room for, so far.
    fn overflowed(&self) -> u32 {
        0
    }

    /// Returns where another process can send frames, 16 bytes each; none: nowhere. It allocates.
    fn duplicate(&self) -> Option<OwnedFd> {
        None
    }
}
