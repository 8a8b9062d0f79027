// SPDX-License-Identifier: Apache-2.0
//! Thread that answers clients. None of its calls blocks on a client:
//!
//! | a client | action |
//! |---|---|
//! | sends part of a request | the part is kept; the other clients are served |
//! | does not read its answers | it is not read until it does; the other clients are served |
//! | sends an invalid frame | its connection is closed |
//! | exceeds the maximum number | the client that has been silent for the longest is disconnected |
use super::tables::Tables;
use crate::modbus::frame::{FRAME_MAX, framed, mbap};
use crate::modbus::pdu::{PDU_MAX, refusal};
use device::Counters;
use forks::Device;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

device::counters! {
    /// Counters of the server.
    pub(super) enum Count {
        Requests: "requests", "", "requests answered";
        Exceptions: "exceptions", "", "requests refused";
        Damaged: "damaged", "", "connections closed because of an invalid frame";
        Connections: "connections", "", "clients that have connected";
        GaveWay: "gave_way", "", "connections closed to make room for a new one";
        Limited: "limited", "", "values that do not fit their register, offered as the nearest value that does";
    }
}

/// State shared by the thread and the driver.
pub(super) struct ServerState {
    pub tables: Mutex<Tables>,
    pub counters: Arc<Counters>,
    /// Number of requests so far; increases as long as a client is active.
    pub asked: AtomicU64,
}

impl ServerState {
    pub(super) fn count(&self, what: Count) {
        self.counters.add(what, 1);
    }

    /// Returns the frame that answers a request.
    fn answer(&self, pdu: &[u8], transaction: u16, unit: u8) -> ([u8; FRAME_MAX], usize) {
        self.count(Count::Requests);
        self.asked.fetch_add(1, Ordering::Relaxed);
        let carried = self.tables.lock().unwrap_or_else(PoisonError::into_inner).carry_out(pdu);
        let answer = carried.unwrap_or_else(|why| {
            self.count(Count::Exceptions);
            refusal(pdu.first().copied().unwrap_or(0), why)
        });
        mbap(transaction, unit, answer.bytes())
    }
}

/// A client, with its received bytes that have not been processed and its answer that has not been sent completely.
struct Client {
    stream: Device<TcpStream>,
    came: [u8; FRAME_MAX],
    filled: usize,
    answer: [u8; FRAME_MAX],
    /// Range of the answer that has not been sent.
    left: (usize, usize),
    /// Number of the round in which the client last sent something; round numbers only increase.
    heard: u64,
}

/// Serves until the other end of `ends` is closed.
pub(super) fn serve(listener: &TcpListener, ends: &UnixStream, most: usize, shared: &ServerState) {
    let mut clients: Vec<Client> = Vec::with_capacity(most);
    let mut asked: Vec<libc::pollfd> = Vec::with_capacity(most + 2);
    let mut turn = 0_u64;
    loop {
        let entry = |fd: RawFd, events: i16| libc::pollfd { fd, events, revents: 0 };
        asked.clear();
        asked.extend([entry(ends.as_raw_fd(), libc::POLLIN), entry(listener.as_raw_fd(), libc::POLLIN)]);
        asked.extend(clients.iter().map(|client| entry(client.stream.as_raw_fd(), if client.owes() { libc::POLLOUT } else { libc::POLLIN })));
        // SAFETY: the array has that number of entries and is a live local one.
        let ready = unsafe { libc::poll(asked.as_mut_ptr(), asked.len() as libc::nfds_t, -1) };
        if ready < 0 {
            match std::io::Error::last_os_error().kind() {
                ErrorKind::Interrupted => continue,
                _ => return,
            }
        }
        if asked[0].revents != 0 {
            return;
        }
        turn += 1;
        let mut is_ready = asked[2..].iter().map(|entry| entry.revents != 0);
        clients.retain_mut(|client| !is_ready.next().unwrap_or(false) || client.serve(turn, shared));
        if asked[1].revents != 0 {
            accept(listener, &mut clients, most, turn, shared);
        }
    }
}

fn accept(listener: &TcpListener, clients: &mut Vec<Client>, most: usize, turn: u64, shared: &ServerState) {
    let Ok((stream, _)) = listener.accept() else { return };
    if stream.set_nonblocking(true).is_err() || stream.set_nodelay(true).is_err() {
        return;
    }
    shared.count(Count::Connections);
    if clients.len() >= most {
        let silent = (0..clients.len()).min_by_key(|at| clients[*at].heard);
        silent.map(|at| clients.swap_remove(at));
        shared.count(Count::GaveWay);
    }
    clients.push(Client { stream: Device::new(stream), came: [0; FRAME_MAX], filled: 0, answer: [0; FRAME_MAX], left: (0, 0), heard: turn });
}

impl Client {
    fn owes(&self) -> bool {
        self.left.0 < self.left.1
    }

    /// Serves the client as far as possible without blocking; returns false if it has disconnected.
    fn serve(&mut self, turn: u64, shared: &ServerState) -> bool {
        if self.owes() {
            return self.send() && (self.owes() || self.requests(shared));
        }
        match self.stream.read(&mut self.came[self.filled..]) {
            Ok(0) => false,
            Ok(more) => {
                (self.filled, self.heard) = (self.filled + more, turn);
                self.requests(shared)
            }
            Err(why) => matches!(why.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
        }
    }

    /// Answers the received requests until an answer cannot be sent completely.
    fn requests(&mut self, shared: &ServerState) -> bool {
        let mut pdu = [0; PDU_MAX];
        loop {
            let (transaction, unit, pdu) = match framed(&self.came[..self.filled]) {
                Ok(None) => return true,
                Err(_) => {
                    shared.count(Count::Damaged);
                    return false;
                }
                Ok(Some(frame)) => {
                    let (len, count) = (frame.len, frame.pdu.len());
                    pdu[..count].copy_from_slice(frame.pdu);
                    let (transaction, unit) = (frame.transaction, frame.unit);
                    self.came.copy_within(len..self.filled, 0);
                    self.filled -= len;
                    (transaction, unit, &pdu[..count])
                }
            };
            let (answer, len) = shared.answer(pdu, transaction, unit);
            (self.answer, self.left) = (answer, (0, len));
            if !self.send() {
                return false;
            }
            if self.owes() {
                return true;
            }
        }
    }

    fn send(&mut self) -> bool {
        while self.owes() {
            match self.stream.write(&self.answer[self.left.0..self.left.1]) {
                Ok(taken) => self.left.0 += taken,
                Err(why) if why.kind() == ErrorKind::Interrupted => {}
                Err(why) => return why.kind() == ErrorKind::WouldBlock,
            }
        }
        true
    }
}
