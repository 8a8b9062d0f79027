// SPDX-License-Identifier: Apache-2.0
//! Link between two processes of one host: frames over a Unix socket, optionally with descriptors.
//!
//! A frame consists of its length and its number of descriptors, four bytes each, followed by its bytes. Both are checked first; a frame
//! that exceeds the limits closes the link, because the bytes that follow cannot be parsed.
use crate::passing::{self, DESCRIPTORS_MAX};
use interconnect::{Link, LinkClosed};
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Maximum size of a frame: 64 MiB.
pub const FRAME_LEN_MAX: usize = 64 << 20;
const HEADER: usize = 8;
/// Increment in which memory is allocated as bytes arrive, regardless of the length that the header declares.
const ROOM: usize = 1 << 18;

/// A frame with its descriptors.
pub type Frame = (Vec<u8>, Vec<OwnedFd>);

/// One side of a link between two processes.
#[derive(Debug)]
pub struct UnixLink {
    socket: UnixStream,
    sending: Mutex<()>,
    incoming: Mutex<Incoming>,
}

/// Part of the next frame that has been received.
#[derive(Debug, Default)]
struct Incoming {
    bytes: Vec<u8>,
    descriptors: Vec<OwnedFd>,
    /// Number of bytes received so far in `bytes`.
    have: usize,
}

impl UnixLink {
    /// Creates the two sides of a new link: one to keep, and one to pass to a process that is started.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn pair() -> io::Result<(UnixLink, OwnedFd)> {
        let (ours, theirs) = UnixStream::pair()?;
        Ok((UnixLink::of(ours)?, theirs.into()))
    }

    /// Wraps the socket passed to this process as one side of a link. The link is closed if the socket is not a connected Unix stream
    /// socket.
    ///
    /// # Errors
    /// Fails if the descriptor is not a socket.
    pub fn from_descriptor(descriptor: OwnedFd) -> io::Result<UnixLink> {
        UnixLink::of(UnixStream::from(descriptor))
    }

    pub(crate) fn of(socket: UnixStream) -> io::Result<UnixLink> {
        socket.set_nonblocking(true)?;
        Ok(UnixLink { socket, sending: Mutex::new(()), incoming: Mutex::default() })
    }

    /// Sends a frame and duplicates of at most [`DESCRIPTORS_MAX`] descriptors. If the socket's buffer stays full for `limit`, the link
    /// is closed, because a partly sent frame cannot be withdrawn.
    ///
    /// # Errors
    /// [`LinkClosed`] if the other side has disconnected, or did not read for `limit`.
    pub fn send_with(&self, frame: &[u8], descriptors: &[BorrowedFd<'_>], limit: Option<Duration>) -> Result<(), LinkClosed> {
        if frame.len() > FRAME_LEN_MAX || descriptors.len() > DESCRIPTORS_MAX {
            self.close();
            return Err(LinkClosed);
        }
        let deadline = limit.map(|limit| Instant::now() + limit);
        let mut header = [0; HEADER];
        header[..4].copy_from_slice(&(frame.len() as u32).to_le_bytes());
        header[4..].copy_from_slice(&(descriptors.len() as u32).to_le_bytes());
        let _one_at_a_time = self.sending.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = self.send_all(&header, descriptors, deadline).and_then(|()| self.send_all(frame, &[], deadline));
        if sent.is_err() {
            self.close();
        }
        sent
    }

    fn send_all(&self, mut bytes: &[u8], mut descriptors: &[BorrowedFd<'_>], deadline: Option<Instant>) -> Result<(), LinkClosed> {
        while !bytes.is_empty() {
            match passing::send(self.socket.as_fd(), bytes, descriptors) {
                Ok(sent) => {
                    bytes = &bytes[sent..];
                    descriptors = &[];
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if !self.ready(libc::POLLOUT, deadline) {
                        return Err(LinkClosed);
                    }
                }
                Err(_) => return Err(LinkClosed),
            }
        }
        Ok(())
    }

    /// Returns the next frame with its descriptors; `None` if none arrived within `limit`.
    ///
    /// # Errors
    /// [`LinkClosed`] as for [`Link::receive`], or if the received bytes are not a frame.
    pub fn receive_with(&self, limit: Duration) -> Result<Option<Frame>, LinkClosed> {
        let deadline = Instant::now() + limit;
        let mut incoming = self.incoming.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            match incoming.take(self.socket.as_fd()) {
                Ok(Progress::Whole(frame)) => return Ok(Some(frame)),
                Ok(Progress::Part) => {}
                Ok(Progress::Empty) => {
                    if !self.ready(libc::POLLIN, Some(deadline)) {
                        return Ok(None);
                    }
                }
                Err(LinkClosed) => {
                    self.close();
                    return Err(LinkClosed);
                }
            }
        }
    }

    /// Waits until the socket is ready or closed, then returns true. Returns false at the deadline.
    fn ready(&self, events: libc::c_short, deadline: Option<Instant>) -> bool {
        loop {
            let left = deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
            // Rounded up, because a wait that ends early would be repeated with a zero timeout.
            let left_ms = left.map_or(-1, |left| i32::try_from(left.as_micros().div_ceil(1000)).unwrap_or(i32::MAX));
            let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events, revents: 0 };
            // SAFETY: one entry of our own.
            if unsafe { libc::poll(&mut poll, 1, left_ms) } > 0 {
                return true;
            }
            if left.is_some_and(|left| left.is_zero()) {
                return false;
            }
        }
    }

    /// Returns the user and process of the other side at the time it connected.
    ///
    /// # Errors
    /// Fails if the link is not connected.
    pub fn peer(&self) -> io::Result<(u32, i32)> {
        let mut peer = libc::ucred { pid: 0, uid: 0, gid: 0 };
        let mut len = size_of::<libc::ucred>() as libc::socklen_t;
        // SAFETY: `peer` has the size that `len` says.
        let asked = unsafe { libc::getsockopt(self.socket.as_raw_fd(), libc::SOL_SOCKET, libc::SO_PEERCRED, (&raw mut peer).cast(), &mut len) };
        if asked == 0 { Ok((peer.uid, peer.pid)) } else { Err(io::Error::last_os_error()) }
    }
}

impl Link for UnixLink {
    fn send(&self, frame: &[u8]) -> Result<(), LinkClosed> {
        self.send_with(frame, &[], None)
    }

    fn receive(&self, limit: Duration) -> Result<Option<Vec<u8>>, LinkClosed> {
        self.receive_with(limit).map(|frame| frame.map(|(bytes, _)| bytes))
    }

    fn close(&self) {
        // Fails only if the other side has done so already.
        let _closed = self.socket.shutdown(std::net::Shutdown::Both);
    }
}

impl AsFd for UnixLink {
    /// Returns the socket, so that it can be polled with others.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

impl Drop for UnixLink {
    fn drop(&mut self) {
        self.close();
    }
}

enum Progress {
    Whole(Frame),
    Part,
    Empty,
}

impl Incoming {
    /// Receives from the socket once.
    fn take(&mut self, socket: BorrowedFd<'_>) -> Result<Progress, LinkClosed> {
        let (len, promised) = if self.have < HEADER { (0, 0) } else { self.header()? };
        let end = if self.have < HEADER { HEADER } else { HEADER + len };
        if self.have == end && self.have >= HEADER {
            return self.whole(promised);
        }
        self.bytes.resize(end.min(self.have + ROOM), 0);
        match passing::receive(socket, &mut self.bytes[self.have..], &mut self.descriptors) {
            Ok(0) => Err(LinkClosed),
            Ok(received) => {
                self.have += received;
                if self.descriptors.len() > DESCRIPTORS_MAX {
                    return Err(LinkClosed);
                }
                Ok(Progress::Part)
            }
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock => Ok(Progress::Empty),
                io::ErrorKind::Interrupted => Ok(Progress::Part),
                _ => Err(LinkClosed),
            },
        }
    }

    /// Decodes the header: the number of bytes and the number of descriptors.
    fn header(&self) -> Result<(usize, usize), LinkClosed> {
        let number = |at: usize| u32::from_le_bytes(self.bytes[at..at + 4].try_into().expect("four bytes")) as usize;
        let (len, descriptors) = (number(0), number(4));
        if len > FRAME_LEN_MAX || descriptors > DESCRIPTORS_MAX { Err(LinkClosed) } else { Ok((len, descriptors)) }
    }

    fn whole(&mut self, promised: usize) -> Result<Progress, LinkClosed> {
        let Incoming { mut bytes, descriptors, .. } = std::mem::take(self);
        if descriptors.len() != promised {
            return Err(LinkClosed);
        }
        bytes.drain(..HEADER);
        Ok(Progress::Whole((bytes, descriptors)))
    }
}
