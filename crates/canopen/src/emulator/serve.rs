// SPDX-License-Identifier: Apache-2.0
//! Answers frames on a local socket with an emulated bus, in a thread or as a separate process.
use super::bus::Bus;
use super::said::NodeOptions;
use crate::frame::{self, Came};
use crate::link::{LOCAL, Socket, hears, wishes};
use cia402::emulated;
use serde::Deserialize;
use std::io;
use std::mem::{size_of, zeroed};
use std::os::fd::{AsRawFd, OwnedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which time advances if no controller sets it, and at which a server checks whether it must stop.
const NOTICE_MS: i32 = 10;
/// Time limit for an endpoint to accept the answer that it requested.
const LISTENS: Duration = Duration::from_secs(1);
/// Duration for which a time set by a controller takes precedence.
const TOLD: Duration = Duration::from_millis(200);

/// A bus that answers frames until it is dropped.
pub type Server = emulated::Server<Bus>;

/// Answers frames on a local socket (`local:NAME`) in a separate thread.
///
/// # Errors
/// Fails if the name is already in use.
pub fn serve(interface: &str, bus: Bus) -> io::Result<Server> {
    if !interface.starts_with(LOCAL) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "an emulated bus answers on local:NAME"));
    }
    let socket = Socket::answering(interface)?;
    Server::start("canopen-bus", bus, move |of, until| Line::new(socket).answer(of, until))
}

/// Endpoints on the line.
struct Line {
    socket: OwnedFd,
    ends: Vec<End>,
    /// Time set by the controller, and the instant at which it was received.
    told: Option<(i64, Instant)>,
    gone_on: Instant,
}

struct End {
    at: Address,
    heard: Vec<(u16, u16)>,
}

#[derive(Clone, Copy)]
struct Address {
    of: libc::sockaddr_un,
    len: libc::socklen_t,
}

impl PartialEq for Address {
    fn eq(&self, other: &Address) -> bool {
        self.len == other.len && self.of.sun_path == other.of.sun_path
    }
}

impl Line {
    fn new(socket: OwnedFd) -> Line {
        Line { socket, ends: Vec::new(), told: None, gone_on: Instant::now() }
    }

    fn answer(mut self, bus: &Mutex<Bus>, stop: &AtomicBool) {
        let mut bytes = [0; 64];
        while !stop.load(Ordering::Relaxed) {
            let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events: libc::POLLIN, revents: 0 };
            // SAFETY: one entry, owned by us during the call.
            unsafe { libc::poll(&raw mut poll, 1, NOTICE_MS) };
            let mut bus = bus.lock().unwrap_or_else(PoisonError::into_inner);
            while let Some((len, from)) = self.take(&mut bytes) {
                self.heed(&mut bus, &bytes[..len], &from);
            }
            let span_ns = self.gone_on.elapsed().as_nanos() as i64;
            if self.told.is_none_or(|(_, when)| when.elapsed() > TOLD) && span_ns > i64::from(NOTICE_MS) * 500_000 {
                self.gone_on = Instant::now();
                bus.go_on(span_ns);
            }
            self.pass_on(&mut bus, None);
        }
    }

    /// Executes a datagram: a frame, or a time up to which all frames must be answered.
    fn heed(&mut self, bus: &mut Bus, bytes: &[u8], from: &Address) {
        if let Some(heard) = wishes(bytes) {
            self.ends.push(End { at: *from, heard });
            return;
        }
        match (<[u8; 8]>::try_from(bytes), frame::read(bytes)) {
            (Ok(time), _) => {
                let now_ns = i64::from_ne_bytes(time);
                let span_ns = self.told.map_or(0, |(before, _)| now_ns.saturating_sub(before)).max(0);
                (self.told, self.gone_on) = (Some((now_ns, Instant::now())), Instant::now());
                bus.go_on(span_ns);
                self.pass_on(bus, Some(from));
                // An end that has disconnected meanwhile needs no answer.
                let _ = self.put_surely(bytes, from);
            }
            (_, Came::Frame(frame)) => {
                bus.take(&frame);
                self.pass_on(bus, Some(from));
            }
            _ => {}
        }
    }

    /// Sends the messages of the nodes to all endpoints. The requesting endpoint receives them reliably; others miss them if they are not
    /// receiving.
    fn pass_on(&mut self, bus: &mut Bus, asker: Option<&Address>) {
        while let Some(bytes) = bus.said() {
            let ends = std::mem::take(&mut self.ends);
            let put = |end: &Address| if asker == Some(end) { self.put_surely(&bytes, end) } else { self.put(&bytes, end) };
            let is_there = |put: &io::Result<()>| put.as_ref().err().is_none_or(|error| error.kind() == io::ErrorKind::WouldBlock);
            let is_for = |end: &End| !matches!(frame::read(&bytes), Came::Frame(frame) if !hears(&end.heard, frame.id));
            // An end that filters a frame out is not checked by it; the next frame that it receives shows whether it exists.
            let there: Vec<End> = ends.into_iter().filter(|end| !is_for(end) || is_there(&put(&end.at))).collect();
            self.ends = there;
        }
    }

    /// Sends a frame reliably: if the short queue of the local socket is full, waits, because the endpoint will read soon.
    fn put_surely(&self, bytes: &[u8], to: &Address) -> io::Result<()> {
        let until = Instant::now() + LISTENS;
        loop {
            match self.put(bytes, to) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock && Instant::now() < until => std::thread::yield_now(),
                put => return put,
            }
        }
    }

    /// Sends a frame to an endpoint.
    fn put(&self, bytes: &[u8], to: &Address) -> io::Result<()> {
        let flags = libc::MSG_DONTWAIT | libc::MSG_NOSIGNAL;
        // SAFETY: the bytes and the address are owned by us during the call, and have these lengths.
        let sent = unsafe { libc::sendto(self.socket.as_raw_fd(), bytes.as_ptr().cast(), bytes.len(), flags, (&raw const to.of).cast(), to.len) };
        if sent < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
    }

    fn take(&self, into: &mut [u8]) -> Option<(usize, Address)> {
        // SAFETY: all zeros are a valid value of this C type.
        let mut from = Address { of: unsafe { zeroed() }, len: size_of::<libc::sockaddr_un>() as libc::socklen_t };
        let (socket, at) = (self.socket.as_raw_fd(), into.as_mut_ptr().cast());
        // SAFETY: the bytes and the address are owned by us during the call, and have these lengths.
        let received = unsafe { libc::recvfrom(socket, at, into.len(), libc::MSG_DONTWAIT, (&raw mut from.of).cast(), &raw mut from.len) };
        usize::try_from(received).ok().map(|len| (len, from))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    interface: String,
    nodes: Vec<NodeOptions>,
}

/// Command to a bus, one per line.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
enum Order {
    Power { node: u8, on: bool },
    Lose { frames: u64 },
    Spoil { frames: u64 },
    Fail { node: u8, error: u16 },
    EnableInput { node: u8, closed: bool },
    BusOff,
    Put { node: u8, terminal: String, number: u8, value: i64 },
    Show,
}

/// Main function of a process that emulates a bus. The first line of its input contains its options, `{"interface": "local:x", "nodes":
/// [{"name": "x", "node": 1}]}`; each subsequent line is a command, `{"do": "power", "node": 1, "on": false}`, which the process answers
/// with one line that contains the state of the bus. The process exits when its input ends.
///
/// # Errors
/// Fails with a message.
pub fn run() -> Result<(), String> {
    let start = |options: Options| serve(&options.interface, Bus::new(&options.nodes)).map_err(|error| format!("interface '{}': {error}", options.interface));
    emulated::serve_orders(start, carry_out, Bus::show)
}

fn carry_out(bus: &mut Bus, order: &Order) {
    match order {
        Order::Power { node, on } => bus.power(*node, *on),
        Order::Lose { frames } => bus.lose(*frames),
        Order::Spoil { frames } => bus.spoil(*frames),
        Order::Fail { node, error } => bus.fail(*node, *error),
        Order::EnableInput { node, closed } => bus.set_enable_input(*node, *closed),
        Order::BusOff => bus.bus_off(),
        Order::Put { node, terminal, number, value } => bus.put(*node, terminal, *number, *value),
        Order::Show => {}
    }
}
