// SPDX-License-Identifier: Apache-2.0
//! The frame of each cycle: all process data, the state of each subdevice, and the time. Nothing here allocates or blocks.
use super::bring_up::{Line, Station};
use super::bus::{OFF_CYCLE, SOURCE};
use super::clocks::Reference;
use crate::frames::{self, Builder, Command, Datagram, FRAME_MAX, MalformedFrame, u16_at};
use crate::link::Link;
use crate::registers as reg;
use crate::states::State;

/// Maximum number of frames to check in one reading, because frames of services also arrive.
const LOOKED_AT: usize = 32;

/// The frame, as sent and as returned.
pub struct Cycle {
    link: Link,
    frame: Box<[u8; FRAME_MAX]>,
    received: Box<[u8; FRAME_MAX]>,
    newest: Box<[u8; FRAME_MAX]>,
    len: usize,
    process: Datagram,
    states: Vec<Datagram>,
    time: Option<Time>,
    outputs: usize,
    expected: u16,
    index: u8,
    is_out: bool,
}

/// Datagrams of the distributed clocks.
struct Time {
    /// Sends this host's time to the reference clock. Has no effect until that time is known.
    follow: Datagram,
    /// Distributes the time of the reference clock to all other clocks.
    pass: Datagram,
    counted: u16,
    /// Reads the difference from the reference clock, from one subdevice after another.
    difference: Datagram,
    /// Station addresses of the subdevices with SYNC0, and the index of the one being read.
    synced: Vec<u16>,
    asked: usize,
    differences_ns: Vec<u32>,
    /// Low halves of the times of this host and of the reference clock.
    told_ns: u32,
    reference_ns: u32,
}

/// State of the distributed clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Maximum difference of an axis from the reference clock, ns.
    pub difference_ns: u32,
    /// Difference of the reference clock from the time most recently sent to it, ns.
    pub reference_ns: i32,
}

/// Reason why a frame is not the answer to the frame that was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnswerError {
    Malformed(MalformedFrame),
    /// The frame belongs to another cycle, or to another main device.
    Other,
    /// The frame contains different datagrams, or outputs that were not sent.
    Changed,
}

/// Answer to the frame that was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameAnswer {
    /// All subdevices responded as expected, and the inputs are new.
    Whole,
    /// The frame returned, but not all subdevices responded as expected.
    Short,
    /// The frame did not return.
    Nothing,
    /// No frame was sent.
    NotAsked,
}

impl Cycle {
    /// Creates the frame for these subdevices; returns `None` if it is too long.
    pub fn new(link: Link, line: &Line) -> Option<Cycle> {
        let Line { stations, outputs, inputs, reference, .. } = line;
        let (outputs, inputs) = (*outputs, *inputs);
        let mut frame = Box::new([0; FRAME_MAX]);
        let mut builder = Builder::new(&mut frame, SOURCE);
        let process = builder.add(Command::LogicalReadWrite, 0, 0, outputs + inputs)?;
        let states = stations.iter().map(|of| builder.add(Command::StationRead, 0, frames::at(of.subdevice.station, reg::AL_STATUS), 6));
        let states: Option<Vec<Datagram>> = states.collect();
        let states = states?;
        let time = match reference {
            Some(reference) => Some(Time::new(&mut builder, *reference, stations)?),
            None => None,
        };
        let len = builder.finish();
        // A subdevice that is written counts as 2, one that is read counts as 1.
        let counted = |of: &Station| {
            let (outputs, inputs) = of.mapping.bytes();
            u16::from(outputs > 0) * 2 + u16::from(inputs > 0)
        };
        let expected = stations.iter().map(counted).sum();
        let boxed = || Box::new([0; FRAME_MAX]);
        Some(Cycle { link, received: boxed(), newest: frame.clone(), frame, len, process, states, time, outputs, expected, index: 0, is_out: false })
    }

    /// Returns all outputs for writing. Call this before [`Cycle::send`].
    pub fn outputs(&mut self) -> &mut [u8] {
        let at = self.process.data_at();
        &mut self.frame[at..at + self.outputs]
    }

    /// Returns the most recently returned process data: outputs, then inputs.
    pub fn newest(&self) -> &[u8] {
        self.process.data(&self.newest[..])
    }

    /// Sends the frame, with this host's time if clocks must follow it. Answers to the previous frame are ignored afterwards.
    ///
    /// # Errors
    /// Fails if the interface is down.
    pub fn send(&mut self, now_ns: Option<u64>) -> std::io::Result<()> {
        self.index = (self.index + 1) % OFF_CYCLE;
        let times = self.time.iter().flat_map(Time::datagrams).map(|of| of.at);
        for at in std::iter::once(self.process.at).chain(self.states.iter().map(|of| of.at)).chain(times) {
            self.frame[at + 1] = self.index;
        }
        if let Some(time) = &mut self.time {
            time.tell(&mut self.frame, now_ns);
        }
        self.is_out = true;
        self.link.send(&self.frame[..self.len])
    }

    /// Checks the received frames, and returns the answer to the last frame sent. `refused` is called for each rejected frame.
    ///
    /// # Errors
    /// Fails if the interface is down.
    pub fn receive(&mut self, mut refused: impl FnMut(AnswerError)) -> std::io::Result<FrameAnswer> {
        if !self.is_out {
            return Ok(FrameAnswer::NotAsked);
        }
        for _ in 0..LOOKED_AT {
            let Some(len) = self.link.receive(&mut self.received[..])? else { break };
            match self.check(&self.received[..len]) {
                Ok(replied) => {
                    self.is_out = false;
                    std::mem::swap(&mut self.received, &mut self.newest);
                    if let Some(time) = &mut self.time {
                        time.learn(&self.newest[..]);
                    }
                    return Ok(replied);
                }
                Err(why) => refused(why),
            }
        }
        Ok(FrameAnswer::Nothing)
    }

    /// Waits for the answer. Must be used only outside the cycle.
    pub fn wait(&mut self, time: std::time::Duration) -> std::io::Result<FrameAnswer> {
        let until = std::time::Instant::now() + time;
        loop {
            let left = until.saturating_duration_since(std::time::Instant::now());
            let replied = self.receive(|_| {})?;
            if replied != FrameAnswer::Nothing || left.is_zero() {
                return Ok(replied);
            }
            self.link.wait(left);
        }
    }

    /// Checks that a frame is the answer to the frame that was sent, with the same datagrams and outputs. Returns whether all subdevices
    /// responded as expected.
    ///
    /// # Errors
    /// Fails with the reason if it is not the answer. A flipped bit in the inputs is detected only by the Ethernet checksum, which the adapter checks.
    pub fn check(&self, frame: &[u8]) -> Result<FrameAnswer, AnswerError> {
        let mut all = frames::datagrams(frame).map_err(AnswerError::Malformed)?;
        for sent in std::iter::once(&self.process).chain(&self.states).chain(self.time.iter().flat_map(Time::datagrams)) {
            let came = all.next().ok_or(AnswerError::Changed)?.map_err(AnswerError::Malformed)?;
            if came.index != self.index {
                return Err(AnswerError::Other);
            }
            // The header consists of command, index, address and length, with the bits that have no meaning.
            let header = sent.at..sent.at + 8;
            if came.at != sent.at || frame[header.clone()] != self.frame[header] {
                return Err(AnswerError::Changed);
            }
        }
        let same = |of: &Datagram, len: usize| frame[of.data_at()..of.data_at() + len] == self.frame[of.data_at()..of.data_at() + len];
        let is_same = all.next().is_none() && same(&self.process, self.outputs) && self.time.as_ref().is_none_or(|time| same(&time.follow, time.follow.len));
        if !is_same {
            return Err(AnswerError::Changed);
        }
        let is_whole = self.process.working_counter(frame) == self.expected
            && self.states.iter().all(|of| of.working_counter(frame) == 1)
            && self.time.as_ref().is_none_or(|time| time.is_whole(&self.frame[..], frame));
        Ok(if is_whole { FrameAnswer::Whole } else { FrameAnswer::Short })
    }

    /// Returns the state and status code of the subdevice with this index in the last frame; `None` if it did not answer.
    pub fn state(&self, of: usize) -> Option<(u16, u16)> {
        let of = self.states.get(of)?;
        let data = of.data(&self.newest[..]);
        (of.working_counter(&self.newest[..]) == 1).then(|| (u16_at(data, 0), u16_at(data, 4)))
    }

    /// Returns true if all subdevices were in this state, without an error, in the last frame.
    pub fn all_are_in(&self, state: State) -> bool {
        (0..self.states.len()).all(|of| self.state(of).is_some_and(|(status, _)| status == state as u16))
    }

    /// Returns the state of the distributed clocks, or `None` if there are none.
    pub fn timing(&self) -> Option<Timing> {
        self.time.as_ref().map(|time| Timing {
            difference_ns: time.differences_ns.iter().copied().max().unwrap_or(0),
            reference_ns: time.reference_ns.wrapping_sub(time.told_ns) as i32,
        })
    }

    /// Returns true if the reference clock has reached a time, which must be less than 2 s away.
    pub fn has_come(&self, to_ns: u64) -> bool {
        self.time.as_ref().is_none_or(|time| time.reference_ns.wrapping_sub(to_ns as u32) as i32 >= 0)
    }

    /// Returns the last frame sent.
    pub fn sent(&self) -> &[u8] {
        &self.frame[..self.len]
    }

    pub fn link(&self) -> &Link {
        &self.link
    }
}

impl Time {
    fn new(builder: &mut Builder<'_>, reference: Reference, stations: &[Station]) -> Option<Time> {
        let follow = builder.add(Command::Nop, 0, frames::at(reference.station, reg::DC_SYSTEM_TIME), 4)?;
        let pass = builder.add(Command::StationReadRestWrite, 0, frames::at(reference.station, reg::DC_SYSTEM_TIME), 8)?;
        let difference = builder.add(Command::StationRead, 0, frames::at(reference.station, reg::DC_DIFFERENCE), 4)?;
        let synced: Vec<u16> = stations.iter().filter(|of| of.is_synced).map(|of| of.subdevice.station).collect();
        let differences_ns = vec![0; synced.len()];
        Some(Time { follow, pass, counted: reference.counted, difference, synced, asked: 0, differences_ns, told_ns: 0, reference_ns: 0 })
    }

    fn datagrams(&self) -> [&Datagram; 3] {
        [&self.follow, &self.pass, &self.difference]
    }

    /// Returns true if the reference clock accepted the time sent to it, and all other clocks accepted the time of the reference clock.
    fn is_whole(&self, sent: &[u8], frame: &[u8]) -> bool {
        let is_told = sent[self.follow.at] != Command::Nop as u8;
        self.follow.working_counter(frame) == u16::from(is_told)
            && self.pass.working_counter(frame) == self.counted
            && self.difference.working_counter(frame) == 1
    }

    fn tell(&mut self, frame: &mut [u8; FRAME_MAX], now_ns: Option<u64>) {
        if let Some(now_ns) = now_ns {
            frame[self.follow.at] = Command::StationWrite as u8;
            self.follow.data_mut(&mut frame[..]).copy_from_slice(&(now_ns as u32).to_le_bytes());
            self.told_ns = now_ns as u32;
        }
        self.asked = (self.asked + 1) % self.synced.len().max(1);
        // Without any, the reference clock is read, whose address is the initial one.
        if let Some(station) = self.synced.get(self.asked) {
            self.difference.set_address(&mut frame[..], frames::at(*station, reg::DC_DIFFERENCE));
        }
    }

    fn learn(&mut self, frame: &[u8]) {
        if self.pass.working_counter(frame) > 0 {
            self.reference_ns = frames::u32_at(self.pass.data(frame), 0);
        }
        if self.difference.working_counter(frame) == 1
            && let Some(of) = self.differences_ns.get_mut(self.asked)
        {
            // The register contains sign and magnitude.
            *of = frames::u32_at(self.difference.data(frame), 0) & 0x7FFF_FFFF;
        }
    }
}
