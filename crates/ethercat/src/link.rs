// SPDX-License-Identifier: Apache-2.0
//! Carrier of frames: a network interface, or a local socket between processes, which needs no privileges.
//!
//! `eth0` is the interface with that name, used through a raw socket, which needs `CAP_NET_RAW`. `local:NAME` is a socket on this machine
//! on which an emulated segment answers.
use crate::frames::ETHERTYPE;
use forks::Device;
use std::ffi::CString;
use std::io;
use std::mem::{size_of, zeroed};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::time::Duration;

/// Endpoint of a line. Never blocks except in [`Link::wait`], and never allocates after it was opened.
pub struct Link {
    socket: Device<OwnedFd>,
    name: String,
}

/// Prefix of local socket names.
const LOCAL: &str = "local:";

impl Link {
    /// Opens the endpoint of a main device.
    ///
    /// # Errors
    /// Fails if the interface does not exist, if the process lacks the privileges to use it, or if no segment answers on the local socket.
    pub fn open(name: &str) -> io::Result<Link> {
        match name.strip_prefix(LOCAL) {
            None => Link::raw(name),
            Some(local) => {
                let link = Link::local(name)?;
                // The kernel assigns a name, to which the segment answers.
                link.bind(&address(""), size_of::<libc::sa_family_t>())?;
                let (to, len) = local_address(local);
                // SAFETY: the address has that length, and we own the descriptor.
                check(unsafe { libc::connect(link.socket.as_raw_fd(), (&raw const to).cast(), len as libc::socklen_t) })?;
                Ok(link)
            }
        }
    }

    /// Opens the endpoint of a segment.
    ///
    /// # Errors
    /// Fails as [`Link::open`] does, and if the name of a local socket is already in use.
    pub fn answering(name: &str) -> io::Result<Link> {
        match name.strip_prefix(LOCAL) {
            None => Link::raw(name),
            Some(local) => {
                let link = Link::local(name)?;
                let (at, len) = local_address(local);
                link.bind(&at, len)?;
                Ok(link)
            }
        }
    }

    fn raw(name: &str) -> io::Result<Link> {
        let interface = CString::new(name).map_err(|_| io::ErrorKind::InvalidInput)?;
        // SAFETY: the text is NUL-terminated.
        let index = unsafe { libc::if_nametoindex(interface.as_ptr()) };
        if index == 0 {
            return Err(io::Error::last_os_error());
        }
        let link = Link::socket(name, libc::AF_PACKET, libc::SOCK_RAW, i32::from(ETHERTYPE.to_be()))?;
        // SAFETY: all zeros are a valid value of this C type.
        let mut to: libc::sockaddr_ll = unsafe { zeroed() };
        (to.sll_family, to.sll_protocol, to.sll_ifindex) = (libc::AF_PACKET as u16, ETHERTYPE.to_be(), index as i32);
        link.bind(&to, size_of::<libc::sockaddr_ll>())?;
        Ok(link)
    }

    fn local(name: &str) -> io::Result<Link> {
        Link::socket(name, libc::AF_UNIX, libc::SOCK_DGRAM, 0)
    }

    fn socket(name: &str, family: i32, kind: i32, protocol: i32) -> io::Result<Link> {
        // SAFETY: a new descriptor, which we alone own.
        let socket = unsafe { OwnedFd::from_raw_fd(check(libc::socket(family, kind | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC, protocol))?) };
        Ok(Link { socket: Device::new(socket), name: name.to_owned() })
    }

    fn bind<A>(&self, to: &A, len: usize) -> io::Result<()> {
        // SAFETY: the address has at least that length, and we own the descriptor.
        check(unsafe { libc::bind(self.socket.as_raw_fd(), (&raw const *to).cast(), len as libc::socklen_t) }).map(drop)
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Sends a frame completely or not at all. Real-time safe.
    ///
    /// # Errors
    /// Fails if the interface is down or its queue is full.
    pub fn send(&self, frame: &[u8]) -> io::Result<()> {
        // SAFETY: the bytes are owned by us during the call.
        let sent = unsafe { libc::send(self.socket.as_raw_fd(), frame.as_ptr().cast(), frame.len(), libc::MSG_DONTWAIT | libc::MSG_NOSIGNAL) };
        if sent < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
    }

    /// Receives a frame; returns `None` if none has arrived. Real-time safe.
    ///
    /// # Errors
    /// Fails if the interface is down.
    pub fn receive(&self, into: &mut [u8]) -> io::Result<Option<usize>> {
        // SAFETY: the bytes are owned by us during the call.
        let received = unsafe { libc::recv(self.socket.as_raw_fd(), into.as_mut_ptr().cast(), into.len(), libc::MSG_DONTWAIT) };
        there(received)
    }

    /// Receives a frame and stores its sender, for [`Link::answer`].
    pub(crate) fn receive_from(&self, into: &mut [u8], from: &mut Sender) -> io::Result<Option<usize>> {
        from.len = size_of::<libc::sockaddr_un>() as libc::socklen_t;
        let (socket, to) = (self.socket.as_raw_fd(), into.as_mut_ptr().cast());
        // SAFETY: the bytes and the address are owned by us during the call, and have these lengths.
        let received = unsafe { libc::recvfrom(socket, to, into.len(), libc::MSG_DONTWAIT, (&raw mut from.address).cast(), &raw mut from.len) };
        there(received)
    }

    /// Sends a frame back. Does nothing if the receiver has disconnected.
    pub(crate) fn answer(&self, frame: &[u8], to: &Sender) {
        if !self.name.starts_with(LOCAL) {
            return drop(self.send(frame));
        }
        let (socket, bytes) = (self.socket.as_raw_fd(), frame.as_ptr().cast());
        // SAFETY: the bytes and the address are owned by us during the call, and have these lengths.
        unsafe { libc::sendto(socket, bytes, frame.len(), libc::MSG_DONTWAIT | libc::MSG_NOSIGNAL, (&raw const to.address).cast(), to.len) };
    }

    /// Waits until a frame arrives, but at most for this time; returns false if none has arrived.
    pub fn wait(&self, time: Duration) -> bool {
        let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        let time_ms = time.as_nanos().div_ceil(1_000_000).min(1_000_000) as i32;
        // SAFETY: one entry, owned by us during the call.
        unsafe { libc::poll(&raw mut poll, 1, time_ms) > 0 }
    }
}

/// Sender of a frame.
pub(crate) struct Sender {
    address: libc::sockaddr_un,
    len: libc::socklen_t,
}

impl Sender {
    pub fn nobody() -> Sender {
        Sender { address: address(""), len: 0 }
    }
}

fn there(received: isize) -> io::Result<Option<usize>> {
    if received >= 0 {
        return Ok(Some(received as usize));
    }
    let error = io::Error::last_os_error();
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted | io::ErrorKind::ConnectionRefused => Ok(None),
        _ => Err(error),
    }
}

fn check(returned: i32) -> io::Result<i32> {
    if returned < 0 { Err(io::Error::last_os_error()) } else { Ok(returned) }
}

/// Returns an abstract socket address, which exists as long as its socket and has no file.
fn local_address(name: &str) -> (libc::sockaddr_un, usize) {
    let text = format!("\0opengpac-ethercat-{name}");
    let to = address(&text);
    (to, size_of::<libc::sa_family_t>() + text.len().min(to.sun_path.len()))
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
