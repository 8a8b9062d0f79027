// SPDX-License-Identifier: Apache-2.0
//! A request and its answer. Over TCP, each device has a connection of its own; a serial line is shared in turns by the units on it.
//!
//! | received | action |
//! |---|---|
//! | part of a frame | waits for the rest until the time limit |
//! | an answer to an earlier transaction | drops it, and counts it as late |
//! | an invalid frame, wrong unit, wrong function | counts it as damaged; repeats the request, over TCP on a new connection |
//! | nothing | counts a timeout; repeats the request |
//! | an exception | reports it; repeats the request only if the device is busy |
use super::frame::{self, FRAME_MAX, framed, unframed};
use super::pdu::{Exception, NoAnswer, PDU_MAX, Request};
use super::turn::Turns;
use crate::serial::{Parity, Settings};
use crate::stream::{Address, Stream};
use device::{Counters, DeviceError};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

device::counters! {
    /// Counters of the link.
    pub(super) enum Count {
        Requests: "requests", "", "requests sent, including repeated ones";
        Timeouts: "timeouts", "", "requests that were not answered in time";
        Exceptions: "exceptions", "", "requests that the device refused";
        Damaged: "damaged", "", "answers that were damaged, incomplete or for another request";
        Late: "late", "", "late answers to an earlier request, dropped";
        Reconnects: "reconnects", "", "connections or lines that were opened again";
        Limited: "limited", "", "values that do not fit their register, written as the nearest value that does";
    }
}

/// Parses an address. Defaults: port 502; 19,200 baud, even parity.
pub(super) fn address_of(text: &str) -> Result<Address, String> {
    Address::parse(text, "rtu", Settings { baud: 19_200, parity: Parity::Even, stop_bits: 1 }, Some(502))
}

/// Reasons why a response is rejected as damaged.
const NO_HEADER: &str = "it does not begin with a Modbus TCP header";
const NO_FUNCTION: &str = "its function code or its length is not valid in Modbus";
const WRONG_SUM: &str = "its CRC is wrong; check the cable, terminating resistors, baud rate and parity";
const OTHER_UNIT: &str = "it came from another unit";
const OTHER_REQUEST: &str = "it answers another request: its function, length or address differs";
const MORE: &str = "it is longer than its length field";
const CUT_OFF: &str = "it was incomplete";

/// Reason why there is no answer.
#[derive(Debug)]
pub(super) enum Fault {
    Exception(Exception),
    Timeout(Duration),
    /// The answer was damaged; the value describes the problem.
    Damaged(&'static str),
    /// The connection or the line has failed.
    Broken(String),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Fault::Exception(exception) => write!(f, "{exception}"),
            Fault::Timeout(answer) => write!(f, "no answer within {} ms", answer.as_secs_f64() * 1e3),
            Fault::Damaged(what) => write!(f, "its answer was damaged: {what}"),
            Fault::Broken(why) => f.write_str(why),
        }
    }
}

/// Data of an answer.
pub(super) struct Answer {
    bytes: [u8; PDU_MAX],
    len: usize,
}

impl Answer {
    pub(super) fn data(&self) -> &[u8] {
        &self.bytes[..self.len]
    }

    fn of(data: &[u8]) -> Answer {
        let mut answer = Answer { bytes: [0; PDU_MAX], len: data.len().min(PDU_MAX) };
        answer.bytes[..answer.len].copy_from_slice(&data[..answer.len]);
        answer
    }
}

/// Link to one device; clones address the same one.
#[derive(Clone)]
pub(super) struct Link<L = Arc<Turns<Line>>> {
    line: L,
    /// Address of the device, for messages.
    place: String,
    pub unit: u8,
    /// Time limit for an answer.
    pub answer: Duration,
    /// Number of repetitions of a request.
    pub retries: u32,
    pub counters: Arc<Counters>,
}

/// Serial lines in use by this process, by path.
static LINES: Mutex<BTreeMap<String, Weak<Turns<Line>>>> = Mutex::new(BTreeMap::new());

impl Link {
    /// Creates a link that is not connected or opened yet.
    ///
    /// # Errors
    /// Fails if the line is in use at another baud rate; the error is a message.
    pub(super) fn new(address: &Address, unit: u8, answer: Duration, retries: u32) -> Result<Link, String> {
        let line = match address {
            Address::Tcp(_) => Arc::new(Turns::new(Line::new(address))),
            Address::Serial { path, .. } => {
                let mut lines = LINES.lock().unwrap_or_else(PoisonError::into_inner);
                lines.retain(|_, line| line.strong_count() > 0);
                let shared = lines.get(path).and_then(Weak::upgrade);
                // The lock of this table is released before waiting for a turn.
                let line = shared.unwrap_or_else(|| Arc::new(Turns::new(Line::new(address))));
                lines.insert(path.clone(), Arc::downgrade(&line));
                drop(lines);
                if line.take().address != *address {
                    return Err(format!("another unit on {path} has different line settings; give both the same"));
                }
                line
            }
        };
        Ok(Link { line, place: address.to_string(), unit, answer, retries, counters: Arc::new(Counters::new(Count::WORDS)) })
    }

    /// Returns a link to the same device that does not keep the line open.
    pub(super) fn downgrade(&self) -> Link<Weak<Turns<Line>>> {
        Link {
            line: Arc::downgrade(&self.line),
            place: self.place.clone(),
            unit: self.unit,
            answer: self.answer,
            retries: self.retries,
            counters: self.counters.clone(),
        }
    }

    /// Closes the connection. A serial line is closed when its last unit drops its link.
    pub(super) fn close(&self) {
        let mut line = self.line.take();
        if matches!(line.address, Address::Tcp(_)) {
            line.stream = None;
        }
    }

    pub(super) fn count(&self, what: Count) {
        self.counters.add(what, 1);
    }

    /// Returns the answer to a request, which is repeated up to `retries` times.
    pub(super) fn ask(&self, request: &Request<'_>) -> Result<Answer, DeviceError> {
        let mut left = self.retries;
        loop {
            match self.ask_once(request) {
                Ok(answer) => return Ok(answer),
                Err(fault) if left == 0 || matches!(&fault, Fault::Exception(exception) if !exception.passes()) => return Err(self.error(request, &fault)),
                Err(_) => left -= 1,
            }
        }
    }

    /// Returns a human-readable error for a failed request.
    pub(super) fn error(&self, request: &Request<'_>, fault: &Fault) -> DeviceError {
        DeviceError { message: format!("unit {} at {} did not {request}: {fault}", self.unit, self.place) }
    }

    /// Sends a request once, in this unit's turn, and returns its answer.
    pub(super) fn ask_once(&self, request: &Request<'_>) -> Result<Answer, Fault> {
        let mut line = self.line.take();
        let answer = line.exchange(self, request);
        match &answer {
            Ok(_) => {}
            Err(Fault::Exception(_)) => self.count(Count::Exceptions),
            Err(Fault::Timeout(_)) => self.count(Count::Timeouts),
            Err(Fault::Damaged(_)) => self.count(Count::Damaged),
            Err(Fault::Broken(_)) => line.stream = None,
        }
        // The start of the next frame on this connection is unknown; on a serial line, silence separates frames.
        if matches!((&answer, &line.address), (Err(Fault::Damaged(_)), Address::Tcp(_))) {
            line.stream = None;
        }
        answer
    }
}

impl Link<Weak<Turns<Line>>> {
    /// Returns a link that keeps the line open; `None` if the device was closed.
    pub(super) fn upgrade(&self) -> Option<Link> {
        let line = self.line.upgrade()?;
        Some(Link { line, place: self.place.clone(), unit: self.unit, answer: self.answer, retries: self.retries, counters: self.counters.clone() })
    }
}

/// A connection or line with its received bytes.
pub(super) struct Line {
    address: Address,
    stream: Option<Stream>,
    was_open: bool,
    transaction: u16,
    bytes: [u8; 2 * FRAME_MAX],
    filled: usize,
    /// Time until which a serial line is kept silent, so that all units detect the start of a frame.
    silent_until: Option<Instant>,
}

impl Line {
    fn new(address: &Address) -> Line {
        Line { address: address.clone(), stream: None, was_open: false, transaction: 0, bytes: [0; 2 * FRAME_MAX], filled: 0, silent_until: None }
    }

    fn exchange(&mut self, link: &Link, request: &Request<'_>) -> Result<Answer, Fault> {
        self.open(link)?;
        link.count(Count::Requests);
        let deadline = Instant::now() + link.answer;
        match self.address {
            Address::Tcp(_) => self.over_tcp(link, request, deadline),
            Address::Serial { .. } => {
                let answer = self.over_serial(link, request);
                if matches!(answer, Err(Fault::Damaged(_))) {
                    self.wait_for_silence(deadline);
                }
                self.silent_until = Some(Instant::now() + self.silence());
                answer
            }
        }
    }

    fn open(&mut self, link: &Link) -> Result<(), Fault> {
        if self.stream.is_some() {
            return Ok(());
        }
        let stream = Stream::open(&self.address, Instant::now() + link.answer);
        self.stream = Some(stream.map_err(|why| Fault::Broken(format!("it cannot be opened: {why}")))?);
        self.filled = 0;
        if self.was_open {
            link.count(Count::Reconnects);
        }
        self.was_open = true;
        Ok(())
    }

    fn send(&self, bytes: &[u8], deadline: Instant) -> Result<&Stream, Fault> {
        let stream = self.stream.as_ref().ok_or_else(|| Fault::Broken("it is not open".to_owned()))?;
        stream.write_all(bytes, deadline).map_err(|why| Fault::Broken(why.to_string()))?;
        Ok(stream)
    }

    /// Waits for more bytes.
    fn fill(&mut self, deadline: Instant) -> Result<bool, Fault> {
        let stream = self.stream.as_ref().ok_or_else(|| Fault::Broken("it is not open".to_owned()))?;
        let more = stream.read(&mut self.bytes[self.filled..], deadline).map_err(|why| Fault::Broken(why.to_string()))?;
        self.filled += more;
        Ok(more > 0)
    }

    fn over_tcp(&mut self, link: &Link, request: &Request<'_>, deadline: Instant) -> Result<Answer, Fault> {
        self.transaction = self.transaction.wrapping_add(1);
        let (bytes, len) = frame::mbap(self.transaction, link.unit, request.encode().bytes());
        self.send(&bytes[..len], deadline)?;
        loop {
            while let Some(frame) = framed(&self.bytes[..self.filled]).map_err(|_| Fault::Damaged(NO_HEADER))? {
                let is_mine = frame.transaction == self.transaction;
                let is_of_unit = frame.unit == link.unit;
                let answer = request.answer(frame.pdu).map(Answer::of);
                let len = frame.len;
                self.bytes.copy_within(len..self.filled, 0);
                self.filled -= len;
                match answer {
                    _ if !is_mine => link.count(Count::Late),
                    _ if !is_of_unit => return Err(Fault::Damaged(OTHER_UNIT)),
                    Ok(answer) => return Ok(answer),
                    Err(NoAnswer::Refused(exception)) => return Err(Fault::Exception(exception)),
                    Err(NoAnswer::Foreign) => return Err(Fault::Damaged(OTHER_REQUEST)),
                }
            }
            if !self.fill(deadline)? {
                return Err(Fault::Timeout(link.answer));
            }
        }
    }

    fn over_serial(&mut self, link: &Link, request: &Request<'_>) -> Result<Answer, Fault> {
        if let Some(silent) = self.silent_until.take() {
            std::thread::sleep(silent.saturating_duration_since(Instant::now()));
        }
        // Leftover bytes do not belong to any request.
        self.filled = 0;
        let begun = Instant::now();
        while self.fill(begun)? {
            self.filled = 0;
            link.count(Count::Late);
        }
        let (bytes, len) = frame::rtu(link.unit, request.encode().bytes());
        let sending = self.byte_time() * len as u32;
        let deadline = Instant::now() + sending + link.answer;
        self.send(&bytes[..len], deadline)?;
        loop {
            let begun = &self.bytes[..self.filled];
            match frame::answer_len(begun).map_err(|_| Fault::Damaged(NO_FUNCTION))? {
                Some(len) if self.filled >= len => {
                    let (unit, pdu) = unframed(&begun[..len]).map_err(|_| Fault::Damaged(WRONG_SUM))?;
                    return match request.answer(pdu) {
                        _ if unit != link.unit => Err(Fault::Damaged(OTHER_UNIT)),
                        _ if self.filled != len => Err(Fault::Damaged(MORE)),
                        Ok(data) => Ok(Answer::of(data)),
                        Err(NoAnswer::Refused(exception)) => Err(Fault::Exception(exception)),
                        Err(NoAnswer::Foreign) => Err(Fault::Damaged(OTHER_REQUEST)),
                    };
                }
                _ if self.filled >= FRAME_MAX => return Err(Fault::Damaged(MORE)),
                _ => {}
            }
            if !self.fill(deadline)? {
                return Err(if self.filled == 0 { Fault::Timeout(link.answer) } else { Fault::Damaged(CUT_OFF) });
            }
        }
    }

    /// Waits until the rest of a damaged frame can no longer be mistaken for the start of the next answer. Adapters forward received
    /// bytes every 16 ms.
    fn wait_for_silence(&mut self, deadline: Instant) {
        loop {
            self.filled = 0;
            let silence = self.silence().max(Duration::from_millis(20));
            if !matches!(self.fill((Instant::now() + silence).min(deadline)), Ok(true)) {
                return;
            }
        }
    }

    fn byte_time(&self) -> Duration {
        match &self.address {
            Address::Serial { settings, .. } => settings.byte_time(),
            Address::Tcp(_) => Duration::ZERO,
        }
    }

    /// Returns the transmission time of 3.5 characters, at least 1.75 ms.
    fn silence(&self) -> Duration {
        (self.byte_time() * 7 / 2).max(Duration::from_micros(1_750))
    }
}
