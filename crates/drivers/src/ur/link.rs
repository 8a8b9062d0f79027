// SPDX-License-Identifier: Apache-2.0
//! RTDE connection: blocks only on request, and allocates nothing after construction.
use super::rtde::{self, MalformedMessage, Message};
use crate::serial::wait;
use forks::Device;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

/// Length of the longest message, plus space for the start of the next.
const INPUT_LEN: usize = 2 << 16;
/// Maximum number of times that one call fetches received bytes, so that a controller that floods the connection cannot block the caller.
const FETCHES_MAX: usize = 4;

/// Reason why a connection has failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum LinkError {
    #[error("the controller closed its connection: it was restarted, or is shutting down")]
    Closed,
    #[error("the connection failed: {0}")]
    Failed(#[from] io::Error),
    #[error("the controller sends data that is not RTDE: {0}")]
    Malformed(#[from] MalformedMessage),
}

pub(super) struct Link {
    stream: Device<TcpStream>,
    input: Box<[u8]>,
    filled: usize,
    /// Rest of a package that the connection has not accepted yet. Kept because a package is always sent completely.
    unsent: Vec<u8>,
}

impl Link {
    pub fn connect(to: SocketAddr, within: Duration) -> io::Result<Link> {
        let stream = Device::new(TcpStream::connect_timeout(&to, within)?);
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        Ok(Link { stream, input: vec![0; INPUT_LEN].into_boxed_slice(), filled: 0, unsent: Vec::with_capacity(INPUT_LEN) })
    }

    /// Passes each received message to `take`. Real-time safe if `take` is.
    pub fn receive(&mut self, mut take: impl FnMut(Message<'_>)) -> Result<(), LinkError> {
        for _ in 0..FETCHES_MAX {
            match self.stream.read(&mut self.input[self.filled..]) {
                Ok(0) => return Err(LinkError::Closed),
                Ok(more) => self.filled += more,
                Err(why) if why.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(why) if why.kind() == ErrorKind::Interrupted => continue,
                Err(why) if why.kind() == ErrorKind::ConnectionReset => return Err(LinkError::Closed),
                Err(why) => return Err(why.into()),
            }
            let mut begin = 0;
            while let Some((message, len)) = rtde::decode(&self.input[begin..self.filled])? {
                take(message);
                begin += len;
            }
            self.input.copy_within(begin..self.filled, 0);
            self.filled -= begin;
        }
        Ok(())
    }

    /// Waits until data has been received, or the connection is lost; returns false if the deadline is reached first.
    pub fn wait(&self, deadline: Instant) -> io::Result<bool> {
        wait(self.stream.as_fd(), libc::POLLIN, deadline)
    }

    /// Sends a package; returns false, without sending any of it, if the connection has not accepted the previous one. Real-time safe.
    pub fn send(&mut self, package: &[u8]) -> Result<bool, LinkError> {
        self.flush()?;
        let is_free = self.unsent.is_empty();
        if is_free {
            self.unsent.extend_from_slice(package);
            self.flush()?;
        }
        Ok(is_free)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        while !self.unsent.is_empty() {
            match self.stream.write(&self.unsent) {
                Ok(taken) => {
                    self.unsent.drain(..taken);
                }
                Err(why) if why.kind() == ErrorKind::WouldBlock => break,
                Err(why) if why.kind() == ErrorKind::Interrupted => {}
                Err(why) if matches!(why.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => return Err(LinkError::Closed),
                Err(why) => return Err(why.into()),
            }
        }
        Ok(())
    }
}
