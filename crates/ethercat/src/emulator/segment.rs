// SPDX-License-Identifier: Apache-2.0
//! The line: passes a frame through all subdevices, and simulates faults in frames and on the line.
use super::options::DriveOptions;
use super::subdevice::{Subdevice, SyncHistory};
use crate::frames::{self, Command, Datagram, MalformedFrame};
use crate::states::State;
use serde::Serialize;

/// Counters of a segment.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Counts {
    pub frames: u64,
    pub malformed: u64,
    pub lost: u64,
    pub spoiled: u64,
}

/// The drives and terminals on a line.
pub struct Segment {
    subdevices: Vec<Subdevice>,
    /// Position of the subdevice before which the line is cut.
    cut_at: usize,
    lose: u64,
    spoil: u64,
    random: u64,
    counts: Counts,
}

impl Segment {
    /// Creates a line with these drives and terminals, in order.
    pub fn new(drives: &[DriveOptions]) -> Segment {
        let subdevices: Vec<Subdevice> = (1..).zip(drives).map(|(place, options)| Subdevice::new(options, options.serial.unwrap_or(place))).collect();
        Segment { cut_at: subdevices.len(), subdevices, lose: 0, spoil: 0, random: 1, counts: Counts::default() }
    }

    /// Passes a frame through the line at this time; returns false if the frame is lost.
    pub fn pass(&mut self, frame: &mut [u8], now_ns: u64) -> bool {
        let reached = self.reached();
        self.counts.frames += 1;
        let last_ns: u64 = self.subdevices[..reached].iter().skip(1).map(Subdevice::cable_ns).sum();
        let mut at_ns = 0;
        for (position, subdevice) in self.subdevices[..reached].iter_mut().enumerate() {
            let is_last = position + 1 == reached;
            at_ns += if position == 0 { 0 } else { subdevice.cable_ns() };
            subdevice.set_links(is_last);
            subdevice.go_on(now_ns + at_ns, (!is_last).then_some(2 * (last_ns - at_ns)));
        }
        if reached == 0 {
            return false;
        }
        if self.lose > 0 {
            (self.lose, self.counts.lost) = (self.lose - 1, self.counts.lost + 1);
            return false;
        }
        if self.pass_datagrams(frame, reached, now_ns).is_err() {
            self.counts.malformed += 1;
            return false;
        }
        // The first subdevice marks the returning frame.
        frame[6] |= 2;
        if self.spoil > 0 {
            (self.spoil, self.counts.spoiled) = (self.spoil - 1, self.counts.spoiled + 1);
            self.spoil_one(frame);
        }
        true
    }

    /// Advances time when no frames arrive.
    pub fn go_on(&mut self, now_ns: u64) {
        self.subdevices.iter_mut().filter(|subdevice| subdevice.is_on).for_each(|subdevice| subdevice.go_on(now_ns, None));
    }

    /// Returns the number of subdevices that a frame reaches; a subdevice without power ends the line like a cut cable.
    fn reached(&self) -> usize {
        let off = self.subdevices.iter().position(|subdevice| !subdevice.is_on).unwrap_or(self.subdevices.len());
        off.min(self.cut_at)
    }

    fn pass_datagrams(&mut self, frame: &mut [u8], reached: usize, now_ns: u64) -> Result<(), MalformedFrame> {
        // All headers are checked before anything is executed.
        for datagram in frames::datagrams(frame)? {
            datagram?;
        }
        let mut at = frames::DATAGRAMS;
        loop {
            let (mut datagram, more) = frames::datagram_at(frame, at)?;
            for subdevice in &mut self.subdevices[..reached] {
                pass_one(subdevice, &mut datagram, frame, now_ns);
            }
            if !more {
                return Ok(());
            }
            at = datagram.data_at() + datagram.len + 2;
        }
    }

    /// Flips a bit of a frame, as if the checksum had not detected it.
    fn spoil_one(&mut self, frame: &mut [u8]) {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // The Ethernet addresses are excluded, as they have no meaning here.
        let span = frame.len() - 12;
        let at = 12 + (self.random >> 33) as usize % span;
        frame[at] ^= 1 << (self.random >> 29 & 7);
    }

    /// Drops the next frames.
    pub fn lose(&mut self, frames: u64) {
        self.lose = frames;
    }

    /// Flips a bit in each of the next frames.
    pub fn spoil(&mut self, frames: u64) {
        self.spoil = frames;
    }

    /// Disconnects the cable to the subdevice at this position.
    pub fn cut(&mut self, position: usize) {
        self.cut_at = position;
    }

    /// Reconnects the cable.
    pub fn heal(&mut self) {
        self.cut_at = self.subdevices.len();
    }

    /// Swaps two drives on the line, as happens when cables are mixed up. Both are without power during the swap.
    pub fn swap(&mut self, position: usize, other: usize) {
        if position.max(other) < self.subdevices.len() {
            self.subdevices.swap(position, other);
            for moved in [position, other] {
                self.power(moved, false);
                self.power(moved, true);
            }
        }
    }

    /// Switches the power supply of a drive. A drive that is switched on again has been reset.
    pub fn power(&mut self, position: usize, is_on: bool) {
        if let Some(subdevice) = self.subdevices.get_mut(position) {
            subdevice.power(is_on);
        }
    }

    /// Triggers a fault with a CiA 402 error code in a drive.
    pub fn fail(&mut self, position: usize, error: u16) {
        if let Some(subdevice) = self.subdevices.get_mut(position) {
            subdevice.fail(error);
        }
    }

    /// Closes or opens the enable input of a drive.
    pub fn set_enable_input(&mut self, position: usize, is_closed: bool) {
        if let Some(subdevice) = self.subdevices.get_mut(position) {
            subdevice.set_enable_input(is_closed);
        }
    }

    /// Sets the value at an input of a terminal: 0 or 1, or counts.
    pub fn put(&mut self, position: usize, input: usize, value: i64) {
        if let Some(subdevice) = self.subdevices.get_mut(position) {
            subdevice.put(input, value);
        }
    }

    /// Returns the outputs of a terminal, or `None` if it is not a terminal.
    pub fn carried(&self, position: usize) -> Option<Vec<i64>> {
        self.subdevices.get(position)?.terminal().map(|terminal| terminal.carried())
    }

    /// Returns an object dictionary entry of a drive as a number, as its display would show it.
    pub fn number(&self, position: usize, index: u16) -> i64 {
        self.subdevices.get(position).map_or(0, |subdevice| subdevice.number(index))
    }

    /// Returns the history of a drive's clock and SYNC0.
    pub fn synced(&self, position: usize) -> SyncHistory {
        self.subdevices.get(position).map(Subdevice::synced).unwrap_or_default()
    }

    /// Clears the SYNC0 history.
    pub fn forget_synced(&mut self) {
        self.subdevices.iter_mut().for_each(Subdevice::forget_synced);
    }

    /// Returns a drive's system time at a true time.
    pub fn system_ns(&self, position: usize, now_ns: u64) -> u64 {
        self.subdevices.get(position).map_or(0, |subdevice| subdevice.system_ns(now_ns))
    }

    pub fn state(&self, position: usize) -> Option<State> {
        self.subdevices.get(position).map(Subdevice::state)
    }

    /// Returns the name of a subdevice's state, and of its error.
    pub fn status(&self, position: usize) -> String {
        self.subdevices.get(position).map_or_else(String::new, Subdevice::status)
    }

    pub fn len(&self) -> usize {
        self.subdevices.len()
    }

    pub fn is_empty(&self) -> bool {
        self.subdevices.is_empty()
    }

    pub fn counts(&self) -> Counts {
        self.counts
    }
}

fn pass_one(subdevice: &mut Subdevice, of: &mut Datagram, frame: &mut [u8], now_ns: u64) {
    use Command::*;
    let (device, memory) = (of.address as u16, (of.address >> 16) as u16);
    let by_position = matches!(of.command, PositionRead | PositionWrite | PositionReadWrite | PositionReadRestWrite);
    let by_station = matches!(of.command, StationRead | StationWrite | StationReadWrite | StationReadRestWrite);
    let all = matches!(of.command, AllRead | AllWrite | AllReadWrite);
    let is_meant = by_position && device == 0 || by_station && device == subdevice.station() || all;
    if by_position || all {
        of.address = frames::at(device.wrapping_add(1), memory);
        of.set_address(frame, of.address);
    }
    match of.command {
        Nop => {}
        LogicalRead | LogicalWrite | LogicalReadWrite => subdevice.logical(of, frame, now_ns),
        PositionReadRestWrite | StationReadRestWrite => subdevice.access(of, frame, is_meant, !is_meant, now_ns),
        command if is_meant => {
            let reads = matches!(command, PositionRead | PositionReadWrite | StationRead | StationReadWrite | AllRead | AllReadWrite);
            let writes = !matches!(command, PositionRead | StationRead | AllRead);
            subdevice.access(of, frame, reads, writes, now_ns);
        }
        _ => {}
    }
}
