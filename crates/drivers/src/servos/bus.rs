// SPDX-License-Identifier: Apache-2.0
//! Exchange on a shared line, one request at a time: requests, expected answers, time limits, retries.
use super::frame::{Answer, Ask, FRAME_MAX, Frame, FrameScan};
use super::protocol::Protocol;
use super::registers::{Register, whole};
use crate::serial::{SerialLine, Settings};
use device::Counters;
use std::io::{Error, ErrorKind, Result};
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Maximum number of servos on one bus.
pub(super) const SERVOS_MAX: usize = 64;
/// Maximum delay before a servo answers; the maximum value of its register is 0.5 ms.
const RETURN_DELAY: Duration = Duration::from_millis(1);

device::counters! {
    /// Counters of the bus.
    pub(super) enum Count {
        Exchanges: "exchanges", "", "exchanges in which every servo answered";
        Timeouts: "timeouts", "", "answers that did not come in time";
        Retries: "retries", "", "requests that were repeated";
        FramesBad: "frames_bad", "", "frames with a wrong checksum or length, dropped";
        FramesStrange: "frames_strange", "", "answers without a request, dropped";
        GoalsLimited: "goals_limited", "", "goals that were limited by the range or the maximum speed";
        Alerts: "alerts", "", "readings in which a servo reported an error, including a low voltage";
        HostTime: "host_time", "ns", "processor time of this host for the latest exchange";
    }
}

/// Timing of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    pub(super) baud: u32,
    /// Maximum delay of the adapter and the host in addition to the time on the wire.
    pub(super) latency: Duration,
    pub(super) retries: u32,
    /// True if the adapter echoes sent bytes; `None` if this must be tested.
    pub(super) echo: Option<bool>,
}

/// Answer of a servo to an individual request.
#[derive(Clone, Copy, Debug)]
pub(super) struct ServoAnswer {
    pub(super) error: u8,
    pub(super) value: u32,
}

pub(super) struct Bus {
    line: SerialLine,
    pub(super) protocol: Protocol,
    timing: Timing,
    byte_time: Duration,
    echoes: bool,
    frame: Frame,
    came: [u8; 2 * FRAME_MAX],
    len: usize,
    scratch: [u8; FRAME_MAX],
    counters: Arc<Counters>,
}

impl Bus {
    /// Opens a line.
    ///
    /// # Errors
    /// Fails like [`SerialLine::open`].
    pub(super) fn open(port: &str, protocol: Protocol, timing: Timing, counters: Arc<Counters>) -> Result<Bus> {
        let settings = Settings { baud: timing.baud, ..Settings::default() };
        let line = SerialLine::open(port, &settings)?;
        Ok(Bus {
            line,
            protocol,
            timing,
            byte_time: settings.byte_time(),
            echoes: timing.echo == Some(true),
            frame: Frame::new(),
            came: [0; 2 * FRAME_MAX],
            len: 0,
            scratch: [0; FRAME_MAX],
            counters,
        })
    }

    /// Returns a duplicate of the line's descriptor, for the guard.
    pub(super) fn descriptor(&self) -> Result<OwnedFd> {
        self.line.as_fd().try_clone_to_owned()
    }

    /// Determines whether the adapter echoes sent bytes, unless this is configured. Sends a read request for this purpose, because the
    /// answer to it always differs from the request.
    pub(super) fn find_echo(&mut self, id: u8, register: Register) -> Result<()> {
        if self.timing.echo.is_some() {
            return Ok(());
        }
        let until = self.send(id, Ask::Read { address: register.address, len: register.len }, 1, usize::from(register.len))?;
        let answer = self.protocol.answer_len(usize::from(register.len));
        // An answer may be shorter than an echo would be, and differs from its first bytes on.
        let begins_so = |bus: &Bus| bus.frame.bytes().starts_with(&bus.came[..bus.len.min(bus.frame.bytes().len())]);
        let sent = self.frame.bytes().len();
        while begins_so(self) && self.len < sent && self.receive(until)? {}
        self.echoes = begins_so(self) && self.len >= sent;
        // The answer is discarded.
        let rest = sent * usize::from(self.echoes) + answer;
        while self.len < rest && self.receive(until)? {}
        Ok(())
    }

    /// Returns true if a servo with that ID answers.
    pub(super) fn ping(&mut self, id: u8) -> Result<bool> {
        let len = if self.protocol == Protocol::Dynamixel { 3 } else { 0 };
        self.one(id, Ask::Ping, len).map(|answered| answered.is_some())
    }

    /// Returns the value of a register of up to four bytes; `None` if there is no answer.
    pub(super) fn read(&mut self, id: u8, register: Register) -> Result<Option<ServoAnswer>> {
        self.one(id, Ask::Read { address: register.address, len: register.len }, usize::from(register.len))
    }

    /// Writes to a register; returns `None` if there is no answer.
    pub(super) fn write(&mut self, id: u8, address: u16, bytes: &[u8]) -> Result<Option<ServoAnswer>> {
        self.one(id, Ask::Write { address, bytes }, 0)
    }

    /// Restarts a servo; waits only briefly for its answer, because it may already be shutting down.
    pub(super) fn reboot(&mut self, id: u8) -> Result<()> {
        self.once(id, Ask::Reboot, &[id], &mut [false], 0, &mut |_, _| ())
    }

    /// Writes to the same register of several servos, which do not answer.
    pub(super) fn sync_write(&mut self, register: Register, rows: &[u8]) -> Result<()> {
        let until = self.send(super::frame::BROADCAST, Ask::SyncWrite { address: register.address, len: register.len, rows }, 0, 0)?;
        // Otherwise the echo would precede that of the next request.
        if self.echoes {
            self.drop_echo(until)?;
        }
        Ok(())
    }

    /// Reads the same register of several servos, and repeats the request for those that have not answered. `done[i]` is true if servo i
    /// has answered.
    pub(super) fn sync_read(&mut self, register: Register, ids: &[u8], done: &mut [bool], take: &mut dyn FnMut(usize, Answer<'_>)) -> Result<()> {
        done.fill(false);
        for round in 0..=self.timing.retries {
            let (mut missing, mut count) = ([0; SERVOS_MAX], 0);
            for (id, _) in ids.iter().zip(done.iter()).filter(|(_, done)| !**done) {
                missing[count] = *id;
                count += 1;
            }
            if count == 0 {
                return Ok(());
            }
            self.counters.add(Count::Retries, u64::from(round > 0));
            let ask = Ask::SyncRead { address: register.address, len: register.len, ids: &missing[..count] };
            self.once(super::frame::BROADCAST, ask, ids, done, usize::from(register.len), take)?;
        }
        Ok(())
    }

    /// Sends a request to one servo, and repeats it if there is no answer.
    fn one(&mut self, id: u8, ask: Ask<'_>, len: usize) -> Result<Option<ServoAnswer>> {
        let mut answered = None;
        for round in 0..=self.timing.retries {
            self.counters.add(Count::Retries, u64::from(round > 0));
            let take = &mut |_: usize, answer: Answer<'_>| answered = Some(ServoAnswer { error: answer.error, value: whole(answer.bytes) });
            self.once(id, ask, &[id], &mut [false], len, take)?;
            if answered.is_some() {
                break;
            }
        }
        Ok(answered)
    }

    /// Sends a request, and receives the answers to it within their time limit: `len` bytes from each of `ids` that is not `done`.
    fn once(&mut self, id: u8, ask: Ask<'_>, ids: &[u8], done: &mut [bool], len: usize, take: &mut dyn FnMut(usize, Answer<'_>)) -> Result<()> {
        let mut missing = done.iter().filter(|done| !**done).count();
        let until = self.send(id, ask, missing, len)?;
        if self.echoes && !self.drop_echo(until)? {
            return Ok(());
        }
        while missing > 0 {
            missing -= self.answers(ids, done, len, take);
            if missing > 0 && !self.receive(until)? {
                self.counters.add(Count::Timeouts, missing as u64);
                return Ok(());
            }
        }
        Ok(())
    }

    /// Sends a request, and returns the deadline for its answers.
    fn send(&mut self, id: u8, ask: Ask<'_>, answers: usize, len: usize) -> Result<Instant> {
        self.line.drain_input()?;
        self.len = 0;
        if !self.protocol.write(&mut self.frame, id, ask) {
            return Err(Error::new(ErrorKind::InvalidInput, "the request does not fit a frame, or the protocol does not have it"));
        }
        let bytes = self.frame.bytes();
        // Byte stuffing makes an answer longer by a third at most.
        let wire = bytes.len() + answers * (self.protocol.answer_len(len) + len / 3);
        let times = |of: Duration, count: usize| of * u32::try_from(count).unwrap_or(u32::MAX);
        let until = Instant::now() + times(self.byte_time, wire) + times(RETURN_DELAY, answers) + self.timing.latency;
        self.line.write_all(bytes, until)?;
        Ok(until)
    }

    /// Receives available bytes; returns false if none have arrived by the deadline.
    fn receive(&mut self, until: Instant) -> Result<bool> {
        if self.len == self.came.len() {
            // No request has such a long answer: it is noise.
            self.counters.add(Count::FramesBad, 1);
            self.len = 0;
        }
        let count = self.line.read(&mut self.came[self.len..], until)?;
        self.len += count;
        Ok(count > 0)
    }

    /// Skips the adapter's echo; returns false if it differs from the sent bytes, which means that another host has transmitted.
    fn drop_echo(&mut self, until: Instant) -> Result<bool> {
        let sent = self.frame.bytes().len();
        while self.len < sent {
            if !self.receive(until)? {
                self.counters.add(Count::Timeouts, 1);
                return Ok(false);
            }
        }
        let is_own = &self.came[..sent] == self.frame.bytes();
        self.counters.add(Count::FramesBad, u64::from(!is_own));
        self.leave_out(sent);
        Ok(is_own)
    }

    fn leave_out(&mut self, count: usize) {
        self.came.copy_within(count..self.len, 0);
        self.len -= count;
    }

    /// Takes the complete answers, and returns the number of missing answers that were among them.
    fn answers(&mut self, ids: &[u8], done: &mut [bool], len: usize, take: &mut dyn FnMut(usize, Answer<'_>)) -> usize {
        let (mut from, mut taken) = (0, 0);
        while from < self.len {
            from += match self.protocol.take(&self.came[from..self.len], &mut self.scratch) {
                FrameScan::Part => break,
                FrameScan::Skip(count) => count,
                FrameScan::Bad(count) => {
                    self.counters.add(Count::FramesBad, 1);
                    count
                }
                FrameScan::Frame(count, answer) => {
                    let asked = answer.filter(|answer| answer.bytes.len() == len || is_refusal(self.protocol, answer));
                    match asked.and_then(|answer| ids.iter().position(|id| *id == answer.id).map(|index| (index, answer))) {
                        Some((index, answer)) if !done[index] => {
                            done[index] = true;
                            taken += 1;
                            take(index, answer);
                        }
                        _ => self.counters.add(Count::FramesStrange, 1),
                    }
                    count
                }
            };
        }
        self.leave_out(from.min(self.len));
        taken
    }
}

/// Returns true if an answer contains an error instead of the requested bytes.
fn is_refusal(protocol: Protocol, answer: &Answer<'_>) -> bool {
    protocol == Protocol::Dynamixel && answer.bytes.is_empty() && answer.error & 0x7f != 0
}
