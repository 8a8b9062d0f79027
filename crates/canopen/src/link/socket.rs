// SPDX-License-Identifier: Apache-2.0
//! Sockets: SocketCAN, and a local socket on which an emulated bus answers with the same frames.
use super::end::{LOCAL, Link};
use crate::frame::{self, Came, FRAME_LEN, Frame};
use forks::Device;
use std::ffi::CString;
use std::io;
use std::mem::{size_of, size_of_val, zeroed};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::time::{Duration, Instant};

/// Time limit for an emulated bus to answer all frames.
const SETTLES: Duration = Duration::from_secs(10);
/// Size of the socket's receive buffer, bytes.
const ROOM: libc::c_int = 1 << 20;

/// Endpoint of a bus on a socket.
pub struct Socket {
    socket: Device<OwnedFd>,
    is_local: bool,
    overflowed: u32,
    /// Frames that arrived while the bus was settling, kept so that none are lost.
    kept: std::collections::VecDeque<Came>,
}

/// Maximum number of frames to keep.
const KEPT_MAX: usize = 4096;

impl Socket {
    /// Opens the endpoint of a controller.
    ///
    /// # Errors
    /// Fails if the interface does not exist, or no bus answers on the local socket.
    pub fn open(name: &str, heard: &[(u16, u16)]) -> io::Result<Socket> {
        match name.strip_prefix(LOCAL) {
            None => Socket::raw(name, heard),
            Some(local) => {
                let end = Socket::local()?;
                // The kernel assigns a name, to which the bus answers.
                end.bind(&address(""), size_of::<libc::sa_family_t>())?;
                let (to, len) = local_address(local);
                // SAFETY: the address has that length, and we own the descriptor.
                check(unsafe { libc::connect(end.socket.as_raw_fd(), (&raw const to).cast(), len) })?;
                end.put(&wish(heard))?;
                Ok(end)
            }
        }
    }

    /// Opens the endpoint of a bus on a local socket.
    ///
    /// # Errors
    /// Fails if the name is already in use.
    pub fn answering(name: &str) -> io::Result<OwnedFd> {
        let end = Socket::local()?;
        let (at, len) = local_address(name.strip_prefix(LOCAL).unwrap_or(name));
        end.bind(&at, len as usize)?;
        end.socket.try_clone()
    }

    fn raw(name: &str, heard: &[(u16, u16)]) -> io::Result<Socket> {
        let interface = CString::new(name).map_err(|_| io::ErrorKind::InvalidInput)?;
        // SAFETY: the text is NUL-terminated.
        let index = unsafe { libc::if_nametoindex(interface.as_ptr()) };
        if index == 0 {
            return Err(io::Error::last_os_error());
        }
        let end = Socket::of(libc::AF_CAN, libc::SOCK_RAW, libc::CAN_RAW, false)?;
        let filters: Vec<libc::can_filter> = heard
            .iter()
            .map(|(id, mask)| libc::can_filter { can_id: libc::canid_t::from(*id), can_mask: libc::canid_t::from(*mask) | frame::EXTENDED | frame::REMOTE })
            .collect();
        if !filters.is_empty() {
            end.set(libc::SOL_CAN_RAW, libc::CAN_RAW_FILTER, &filters[..])?;
        }
        let reports = frame::BUS_OFF | frame::CONTROLLER | frame::RESTARTED;
        end.set(libc::SOL_CAN_RAW, libc::CAN_RAW_ERR_FILTER, &[reports])?;
        end.set(libc::SOL_SOCKET, libc::SO_RCVBUF, &[ROOM])?;
        end.set(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &[1 as libc::c_int])?;
        // SAFETY: all zeros are a valid value of this C type.
        let mut to: libc::sockaddr_can = unsafe { zeroed() };
        (to.can_family, to.can_ifindex) = (libc::AF_CAN as u16, index as i32);
        end.bind(&to, size_of::<libc::sockaddr_can>())?;
        Ok(end)
    }

    fn local() -> io::Result<Socket> {
        Socket::of(libc::AF_UNIX, libc::SOCK_DGRAM, 0, true)
    }

    fn of(family: i32, kind: i32, protocol: i32, is_local: bool) -> io::Result<Socket> {
        // SAFETY: a new descriptor, which we alone own.
        let socket = unsafe { OwnedFd::from_raw_fd(check(libc::socket(family, kind | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC, protocol))?) };
        let kept = std::collections::VecDeque::with_capacity(if is_local { KEPT_MAX } else { 0 });
        Ok(Socket { socket: Device::new(socket), is_local, overflowed: 0, kept })
    }

    fn set<T>(&self, level: i32, option: i32, values: &[T]) -> io::Result<()> {
        let len = size_of_val(values) as libc::socklen_t;
        // SAFETY: the values have that length, and we own the descriptor.
        check(unsafe { libc::setsockopt(self.socket.as_raw_fd(), level, option, values.as_ptr().cast(), len) }).map(drop)
    }

    fn bind<A>(&self, to: &A, len: usize) -> io::Result<()> {
        // SAFETY: the address has at least that length, and we own the descriptor.
        check(unsafe { libc::bind(self.socket.as_raw_fd(), (&raw const *to).cast(), len as libc::socklen_t) }).map(drop)
    }

    /// Sends immediately on a physical bus. A local socket has a short queue, which its bus is about to read; this call waits until there
    /// is space.
    fn put(&self, bytes: &[u8]) -> io::Result<()> {
        let until = self.is_local.then(|| Instant::now() + SETTLES);
        loop {
            match (self.put_now(bytes), until) {
                (Err(error), Some(until)) if error.kind() == io::ErrorKind::WouldBlock && Instant::now() < until => {
                    let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events: libc::POLLOUT, revents: 0 };
                    // SAFETY: one entry, owned by us during the call.
                    unsafe { libc::poll(&raw mut poll, 1, 10) };
                }
                (put, _) => return put,
            }
        }
    }

    fn put_now(&self, bytes: &[u8]) -> io::Result<()> {
        // SAFETY: the bytes are owned by us during the call.
        let sent = unsafe { libc::send(self.socket.as_raw_fd(), bytes.as_ptr().cast(), bytes.len(), libc::MSG_DONTWAIT | libc::MSG_NOSIGNAL) };
        if sent < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
    }

    /// Receives a datagram, and updates the count of datagrams that the kernel dropped because the queue was full.
    fn take(&mut self, into: &mut [u8]) -> io::Result<Option<usize>> {
        let mut part = libc::iovec { iov_base: into.as_mut_ptr().cast(), iov_len: into.len() };
        let mut about = [0u64; 8];
        // SAFETY: all zeros are a valid value of this C type.
        let mut message: libc::msghdr = unsafe { zeroed() };
        (message.msg_iov, message.msg_iovlen) = (&raw mut part, 1);
        (message.msg_control, message.msg_controllen) = (about.as_mut_ptr().cast(), size_of_val(&about));
        // SAFETY: everything to which the message points lives through the call.
        let received = unsafe { libc::recvmsg(self.socket.as_raw_fd(), &raw mut message, libc::MSG_DONTWAIT) };
        if received < 0 {
            let error = io::Error::last_os_error();
            return match error.kind() {
                io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => Ok(None),
                _ => Err(error),
            };
        }
        // SAFETY: the kernel has filled in the message.
        let header = unsafe { libc::CMSG_FIRSTHDR(&raw const message) };
        // SAFETY: null, or a header within `about`.
        if let Some(of) = unsafe { header.as_ref() }
            && (of.cmsg_level, of.cmsg_type) == (libc::SOL_SOCKET, libc::SO_RXQ_OVFL)
        {
            // SAFETY: a number of 32 bits follows this header.
            self.overflowed = unsafe { libc::CMSG_DATA(header).cast::<u32>().read_unaligned() };
        }
        Ok(Some(received as usize))
    }
}

impl Link for Socket {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        self.put(&frame.encoded())
    }

    fn receive(&mut self) -> io::Result<Option<Came>> {
        if let Some(kept) = self.kept.pop_front() {
            return Ok(Some(kept));
        }
        let mut bytes = [0; FRAME_LEN + 1];
        loop {
            match self.take(&mut bytes)? {
                // The answer belongs to an earlier request to settle.
                Some(8) if self.is_local => {}
                taken => return Ok(taken.map(|len| frame::read(&bytes[..len]))),
            }
        }
    }

    fn wait(&mut self, time: Duration) {
        let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        let time_ms = time.as_nanos().div_ceil(1_000_000).min(1_000_000) as i32;
        // SAFETY: one entry, owned by us during the call.
        unsafe { libc::poll(&raw mut poll, 1, time_ms) };
    }

    fn settle(&mut self, now_ns: i64) -> io::Result<()> {
        if !self.is_local {
            return Ok(());
        }
        let asked = now_ns.to_ne_bytes();
        self.put(&asked)?;
        let until = Instant::now() + SETTLES;
        let mut bytes = [0; FRAME_LEN + 1];
        loop {
            match self.take(&mut bytes)? {
                Some(8) if bytes[..8] == asked => return Ok(()),
                Some(8) => {}
                Some(len) if self.kept.len() < KEPT_MAX => self.kept.push_back(frame::read(&bytes[..len])),
                Some(_) => self.overflowed += 1,
                None if Instant::now() > until => return Err(io::ErrorKind::TimedOut.into()),
                None => self.wait(SETTLES),
            }
        }
    }

    fn overflowed(&self) -> u32 {
        self.overflowed
    }

    fn duplicate(&self) -> Option<OwnedFd> {
        self.socket.try_clone().ok()
    }
}

fn check(returned: i32) -> io::Result<i32> {
    if returned < 0 { Err(io::Error::last_os_error()) } else { Ok(returned) }
}

/// Returns the message that registers an endpoint and its identifiers with an emulated bus. It is distinguished from a frame and from a
/// time by its length.
fn wish(heard: &[(u16, u16)]) -> Vec<u8> {
    let pairs = heard.iter().flat_map(|(id, mask)| [id.to_ne_bytes(), mask.to_ne_bytes()].concat());
    [0].into_iter().chain(pairs).collect()
}

/// Returns the identifiers of a new endpoint, or `None` if the bytes are a different message.
pub fn wishes(bytes: &[u8]) -> Option<Vec<(u16, u16)>> {
    let (pairs, rest) = bytes.get(1..)?.as_chunks::<4>();
    let heard = pairs.iter().map(|[a, b, c, d]| (u16::from_ne_bytes([*a, *b]), u16::from_ne_bytes([*c, *d])));
    (bytes[0] == 0 && rest.is_empty()).then(|| heard.collect())
}

/// Returns an abstract socket address, which exists as long as its socket and has no file.
fn local_address(name: &str) -> (libc::sockaddr_un, libc::socklen_t) {
    let text = format!("\0opengpac-canopen-{name}");
    let to = address(&text);
    (to, (size_of::<libc::sa_family_t>() + text.len().min(to.sun_path.len())) as libc::socklen_t)
}

fn address(text: &str) -> libc::sockaddr_un {
    // SAFETY: all zeros are a valid value of this C type.
    let mut to: libc::sockaddr_un = unsafe { zeroed() };
    to.sun_family = libc::AF_UNIX as libc::sa_family_t;
    for (to, byte) in to.sun_path.iter_mut().zip(text.bytes()) {
        *to = byte as libc::c_char;
    }
    to
}
