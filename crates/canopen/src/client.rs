// SPDX-License-Identifier: Apache-2.0
//! Reads and writes object dictionary entries of nodes, one at a time, outside the cycle.
use crate::frame::{Came, Frame};
use crate::interface::Interface;
use crate::link::Link;
use crate::message::{self, Message};
use crate::nmt::NODE_MAX;
use crate::sdo::{SdoOutcome, TIMEOUT, Transfer};
use cia402::{Entry, abort_name};
use std::fmt;
use std::io;
use std::time::{Duration, Instant};

/// Maximum number of frames to read before a wait for an answer checks its deadline, because a bus may never be silent.
const TAKEN_MAX: usize = 4096;

/// Endpoint of a bus that receives the answers of SDO servers.
pub struct Client {
    link: Box<dyn Link>,
    answer: Duration,
}

/// Reason why an object dictionary entry could not be read or written.
#[derive(Debug)]
pub enum SdoError {
    /// The node did not answer.
    Silent,
    /// The node aborted the transfer with this code.
    Aborted(u32),
    /// The node violated the protocol.
    Broken,
    Link(io::Error),
}

impl fmt::Display for SdoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SdoError::Silent => write!(f, "it does not answer"),
            SdoError::Aborted(code) => write!(f, "it refuses with {code:#010x}, {}", abort_name(*code)),
            SdoError::Broken => write!(f, "its answer is not an SDO"),
            SdoError::Link(error) => write!(f, "it cannot be reached: {error}"),
        }
    }
}

impl Client {
    /// Opens an endpoint; `answer` is the time limit for each answer from a node.
    ///
    /// # Errors
    /// Fails as [`Interface::open`] does.
    pub fn open(interface: &Interface, answer: Duration) -> io::Result<Client> {
        Ok(Client { link: interface.open(&[(0x580, 0x780)])?, answer })
    }

    /// Reads an object dictionary entry of a node.
    ///
    /// # Errors
    /// Fails if the node does not answer or aborts the transfer.
    pub fn upload(&mut self, node: u8, of: Entry) -> Result<Vec<u8>, SdoError> {
        self.transfer(node, Transfer::upload(of))
    }

    /// Writes an object dictionary entry of a node.
    ///
    /// # Errors
    /// Fails if the node does not answer or aborts the transfer.
    pub fn download(&mut self, node: u8, of: Entry, value: &[u8]) -> Result<(), SdoError> {
        self.transfer(node, Transfer::download(of, value)).map(drop)
    }

    /// Sends any other frame.
    ///
    /// # Errors
    /// Fails if the interface is down or its queue is full.
    pub fn send(&mut self, frame: &Frame) -> io::Result<()> {
        self.link.send(frame)
    }

    fn transfer(&mut self, node: u8, (mut transfer, request): (Transfer, [u8; 8])) -> Result<Vec<u8>, SdoError> {
        let to = 0x600 + u16::from(node);
        // Late answers to earlier requests are not answers to this one.
        for _ in 0..TAKEN_MAX {
            if self.link.receive().map_err(SdoError::Link)?.is_none() {
                break;
            }
        }
        self.link.send(&Frame::new(to, &request)).map_err(SdoError::Link)?;
        let mut until = Instant::now() + self.answer;
        loop {
            let Some(bytes) = self.next(node)? else {
                if Instant::now() >= until {
                    let _ = self.link.send(&Frame::new(to, &transfer.abort(TIMEOUT)));
                    return Err(SdoError::Silent);
                }
                self.link.wait(until.saturating_duration_since(Instant::now()));
                continue;
            };
            match transfer.answer(&bytes) {
                SdoOutcome::Next(request) => {
                    self.link.send(&Frame::new(to, &request)).map_err(SdoError::Link)?;
                    until = Instant::now() + self.answer;
                }
                SdoOutcome::Done(value) => return Ok(value),
                SdoOutcome::Aborted(code) => return Err(SdoError::Aborted(code)),
                SdoOutcome::Strange if Instant::now() >= until => return Err(SdoError::Silent),
                SdoOutcome::Strange => {}
                SdoOutcome::Broken(code) => {
                    let _ = self.link.send(&Frame::new(to, &transfer.abort(code)));
                    return Err(SdoError::Broken);
                }
            }
        }
    }

    /// Returns the next answer from this node, after at most [`TAKEN_MAX`] other frames.
    fn next(&mut self, node: u8) -> Result<Option<[u8; 8]>, SdoError> {
        for _ in 0..TAKEN_MAX {
            let Some(came) = self.link.receive().map_err(SdoError::Link)? else { break };
            if let Came::Frame(frame) = came
                && let Some(Message::Sdo { node: from, bytes }) = message::read(&frame)
                && from == node
            {
                return Ok(Some(bytes));
            }
        }
        Ok(None)
    }

    /// Returns the nodes on the bus that answer a request for their device type, each with its type.
    ///
    /// # Errors
    /// Fails if the interface is down.
    pub fn nodes(&mut self) -> io::Result<Vec<(u8, u32)>> {
        let mut found = Vec::new();
        for node in 1..=NODE_MAX {
            let (_, request) = Transfer::upload(Entry { index: 0x1000, sub: 0 });
            let until = Instant::now() + self.answer;
            while let Err(error) = self.link.send(&Frame::new(0x600 + u16::from(node), &request)) {
                // The queue of the interface is temporarily full.
                let is_full = error.raw_os_error() == Some(libc::ENOBUFS) || error.kind() == io::ErrorKind::WouldBlock;
                if !is_full || Instant::now() > until {
                    return Err(error);
                }
                self.link.wait(Duration::from_millis(1));
            }
            self.gather(&mut found)?;
        }
        let until = Instant::now() + self.answer;
        while Instant::now() < until {
            self.link.wait(until.saturating_duration_since(Instant::now()));
            self.gather(&mut found)?;
        }
        found.sort_unstable();
        found.dedup();
        Ok(found)
    }

    fn gather(&mut self, found: &mut Vec<(u8, u32)>) -> io::Result<()> {
        for _ in 0..TAKEN_MAX {
            let Some(came) = self.link.receive()? else { break };
            if let Came::Frame(frame) = came
                && let Some(Message::Sdo { node, bytes }) = message::read(&frame)
                && bytes[1..4] == [0x00, 0x10, 0]
            {
                let is_value = bytes[0] >> 5 == 2;
                let kind = if is_value { u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]) } else { 0 };
                found.push((node, kind));
            }
        }
        Ok(())
    }
}
