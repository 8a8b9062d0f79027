// SPDX-License-Identifier: Apache-2.0
//! Access to a segment outside the cycle: sends one datagram at a time, and waits for its return.
use crate::frames::{self, Builder, Command, Datagram, FRAME_MAX};
use crate::link::Link;
use std::io::ErrorKind;
use std::time::{Duration, Instant};

/// Time to wait for an answer before the frame is sent again, and maximum number of attempts.
const TRY: Duration = Duration::from_millis(200);
const TRIES: usize = 10;
/// First index of frames sent outside the cycle; frames of the cycle have smaller ones. The ranges differ because each side receives the
/// other's answers on the same interface.
pub const OFF_CYCLE: u8 = 0x80;
/// Source MAC address of the frames; no real network adapter has this address.
pub const SOURCE: [u8; 6] = [0x10, 0x47, 0x50, 0x41, 0x43, 0x01];

/// Access to a segment outside the cycle.
pub struct Bus {
    link: Link,
    frame: Box<[u8; FRAME_MAX]>,
    received: Box<[u8; FRAME_MAX]>,
    index: u8,
}

/// Answer to a frame: data and working counter.
pub struct Answer {
    pub data: Vec<u8>,
    pub counter: u16,
}

impl Bus {
    /// Opens the interface.
    ///
    /// # Errors
    /// Fails with a message if there is no interface with this name, or if the process lacks the privileges to use it.
    pub fn open(interface: &str) -> Result<Bus, String> {
        let link = open_link(interface)?;
        Ok(Bus { link, frame: Box::new([0; FRAME_MAX]), received: Box::new([0; FRAME_MAX]), index: OFF_CYCLE })
    }

    /// Sends a datagram with this data and waits for its return.
    ///
    /// # Errors
    /// Fails with a message if it does not return.
    pub fn ask(&mut self, command: Command, address: u32, data: &[u8]) -> Result<Answer, String> {
        for _ in 0..TRIES {
            self.index = self.index.wrapping_add(1) | OFF_CYCLE;
            let mut builder = Builder::new(&mut self.frame, SOURCE);
            let sent = builder.add(command, self.index, address, data.len()).ok_or("the data are too long for a frame")?;
            let len = builder.finish();
            sent.data_mut(&mut self.frame[..]).copy_from_slice(data);
            match self.link.send(&self.frame[..len]) {
                Ok(()) => {}
                // The queue is full; frames of others leave first.
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    std::thread::sleep(TRY);
                    continue;
                }
                Err(error) => return Err(format!("interface '{}' sends nothing: {error}", self.link.name())),
            }
            if let Some(answer) = self.answer(&sent)? {
                return Ok(answer);
            }
        }
        Err(format!("nothing answers on interface '{}'; check the cable to the first subdevice, and its power", self.link.name()))
    }

    fn answer(&mut self, sent: &Datagram) -> Result<Option<Answer>, String> {
        let until = Instant::now() + TRY;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || !self.link.wait(left) {
                return Ok(None);
            }
            let received = self.link.receive(&mut self.received[..]).map_err(|error| format!("interface '{}': {error}", self.link.name()))?;
            let Some(frame) = received.map(|len| &self.received[..len]) else { continue };
            let Some(Ok(came)) = frames::datagrams(frame).ok().and_then(|mut all| all.next()) else { continue };
            // Positions are incremented on the way, so they are not compared.
            let is_it = (came.command, came.index, came.len, came.at) == (sent.command, sent.index, sent.len, sent.at);
            let came_back = is_it && came.address >> 16 == sent.address >> 16;
            if came_back {
                return Ok(Some(Answer { data: came.data(frame).to_vec(), counter: came.working_counter(frame) }));
            }
        }
    }

    /// Reads memory of the subdevice with this station address.
    ///
    /// # Errors
    /// Fails with a message if the subdevice does not answer.
    pub fn read(&mut self, station: u16, memory: u16, len: usize) -> Result<Vec<u8>, String> {
        self.try_read(station, memory, len)?.ok_or_else(|| silent(station))
    }

    /// Reads as [`Bus::read`] does; returns `None` if the memory cannot be read now, for example because a mailbox is empty.
    pub fn try_read(&mut self, station: u16, memory: u16, len: usize) -> Result<Option<Vec<u8>>, String> {
        let zeros = [0; FRAME_MAX];
        let answer = self.ask(Command::StationRead, frames::at(station, memory), &zeros[..len])?;
        Ok((answer.counter == 1).then_some(answer.data))
    }

    /// Writes memory of the subdevice with this station address.
    ///
    /// # Errors
    /// Fails with a message if the subdevice does not answer.
    pub fn write(&mut self, station: u16, memory: u16, data: &[u8]) -> Result<(), String> {
        if self.try_write(station, memory, data)? { Ok(()) } else { Err(silent(station)) }
    }

    /// Writes as [`Bus::write`] does; returns false if the memory cannot be written now, for example because a mailbox is full.
    pub fn try_write(&mut self, station: u16, memory: u16, data: &[u8]) -> Result<bool, String> {
        Ok(self.ask(Command::StationWrite, frames::at(station, memory), data)?.counter == 1)
    }

    /// Writes memory of all subdevices.
    pub fn write_all(&mut self, memory: u16, data: &[u8]) -> Result<(), String> {
        self.ask(Command::AllWrite, frames::at(0, memory), data).map(drop)
    }
}

/// Opens an interface; the error message includes the remedy.
pub fn open_link(interface: &str) -> Result<Link, String> {
    Link::open(interface).map_err(|error| {
        let remedy = match error.kind() {
            std::io::ErrorKind::PermissionDenied => "give the program the capability cap_net_raw",
            _ => "list the interfaces with `ip link`; use local:NAME for an emulated segment",
        };
        format!("interface '{interface}' cannot be opened: {error}; {remedy}")
    })
}

fn silent(station: u16) -> String {
    format!("the subdevice with station address {station:#06x} does not answer; check its cable and its power")
}
