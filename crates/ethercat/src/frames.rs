// SPDX-License-Identifier: Apache-2.0
//! EtherCAT frames: datagrams in an Ethernet frame, as sent and as returned.
//!
//! A subdevice modifies a frame in place as it passes: data, working counters, auto-increment addresses. Therefore both sides operate on
//! the bytes themselves, and no function here allocates.

/// EtherType of the frames.
pub const ETHERTYPE: u16 = 0x88A4;
/// Maximum length of a frame, without its checksum.
pub const FRAME_MAX: usize = 1514;
/// Minimum length of a frame, without its checksum.
pub const FRAME_MIN: usize = 60;
/// Offset of the first datagram, after the Ethernet and EtherCAT headers.
pub const DATAGRAMS: usize = 16;
/// Overhead of a datagram in addition to its data: header and working counter, bytes.
pub const OVERHEAD: usize = DATAGRAM_HEADER + 2;
const DATAGRAM_HEADER: usize = 10;
const LEN_MASK: u16 = 0x07FF;
const MORE: u16 = 0x8000;
/// Type field in the EtherCAT header of frames that carry datagrams.
const OF_DATAGRAMS: u16 = 0x1000;

/// Command of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Command {
    Nop = 0,
    /// Auto-increment (position) access: read, write, both.
    PositionRead = 1,
    PositionWrite = 2,
    PositionReadWrite = 3,
    /// Configured station address access.
    StationRead = 4,
    StationWrite = 5,
    StationReadWrite = 6,
    /// Broadcast access to all subdevices.
    AllRead = 7,
    AllWrite = 8,
    AllReadWrite = 9,
    /// Logical access, through the FMMUs.
    LogicalRead = 10,
    LogicalWrite = 11,
    LogicalReadWrite = 12,
    /// The addressed subdevice reads, and all subdevices after it write.
    PositionReadRestWrite = 13,
    StationReadRestWrite = 14,
}

impl Command {
    /// Returns the command with this code.
    pub fn of(code: u8) -> Option<Command> {
        use Command::*;
        const ALL: [Command; 15] = [
            Nop,
            PositionRead,
            PositionWrite,
            PositionReadWrite,
            StationRead,
            StationWrite,
            StationReadWrite,
            AllRead,
            AllWrite,
            AllReadWrite,
            LogicalRead,
            LogicalWrite,
            LogicalReadWrite,
            PositionReadRestWrite,
            StationReadRestWrite,
        ];
        ALL.get(usize::from(code)).copied()
    }
}

/// Reason why bytes are not an EtherCAT frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MalformedFrame {
    Short,
    NotEtherCat,
    Length,
    Command,
}

/// Position of a datagram in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Datagram {
    pub command: Command,
    pub index: u8,
    /// Logical address; or position or station address, together with the memory address.
    pub address: u32,
    /// Offset of the datagram's header.
    pub at: usize,
    pub len: usize,
}

impl Datagram {
    /// Returns the offset of the data.
    pub fn data_at(&self) -> usize {
        self.at + DATAGRAM_HEADER
    }

    /// Returns the data.
    pub fn data<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        &frame[self.data_at()..self.data_at() + self.len]
    }

    /// Returns the data for writing.
    pub fn data_mut<'a>(&self, frame: &'a mut [u8]) -> &'a mut [u8] {
        &mut frame[self.data_at()..self.data_at() + self.len]
    }

    /// Returns the working counter, which counts the subdevices that executed the datagram.
    pub fn working_counter(&self, frame: &[u8]) -> u16 {
        u16_at(frame, self.data_at() + self.len)
    }

    pub fn set_working_counter(&self, frame: &mut [u8], counter: u16) {
        put(frame, self.data_at() + self.len, &counter.to_le_bytes());
    }

    pub fn set_address(&self, frame: &mut [u8], address: u32) {
        put(frame, self.at + 2, &address.to_le_bytes());
    }
}

/// Iterator over the datagrams of a frame.
pub struct Datagrams<'a> {
    frame: &'a [u8],
    at: usize,
    end: usize,
    ended: bool,
}

/// Parses the headers of a frame.
///
/// # Errors
/// Fails if it is not an EtherCAT frame or is shorter than its header states.
pub fn datagrams(frame: &[u8]) -> Result<Datagrams<'_>, MalformedFrame> {
    if frame.len() < DATAGRAMS {
        return Err(MalformedFrame::Short);
    }
    if u16::from_be_bytes([frame[12], frame[13]]) != ETHERTYPE {
        return Err(MalformedFrame::NotEtherCat);
    }
    let header = u16_at(frame, 14);
    if header & !LEN_MASK != OF_DATAGRAMS {
        return Err(MalformedFrame::NotEtherCat);
    }
    let end = DATAGRAMS + usize::from(header & LEN_MASK);
    if end > frame.len() || end == DATAGRAMS {
        return Err(MalformedFrame::Length);
    }
    Ok(Datagrams { frame, at: DATAGRAMS, end, ended: false })
}

impl Iterator for Datagrams<'_> {
    type Item = Result<Datagram, MalformedFrame>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let read = self.read();
        self.ended |= read.is_err();
        Some(read)
    }
}

impl Datagrams<'_> {
    fn read(&mut self) -> Result<Datagram, MalformedFrame> {
        let (datagram, more) = datagram_at(&self.frame[..self.end], self.at)?;
        self.at = datagram.data_at() + datagram.len + 2;
        self.ended = !more;
        if self.ended && self.at != self.end {
            return Err(MalformedFrame::Length);
        }
        Ok(datagram)
    }
}

/// Returns the datagram at an offset, and whether another one follows it.
///
/// # Errors
/// Fails if the bytes end before the datagram does, or if its command is unknown.
pub fn datagram_at(frame: &[u8], at: usize) -> Result<(Datagram, bool), MalformedFrame> {
    if at + OVERHEAD > frame.len() {
        return Err(MalformedFrame::Short);
    }
    let command = Command::of(frame[at]).ok_or(MalformedFrame::Command)?;
    let length = u16_at(frame, at + 6);
    let len = usize::from(length & LEN_MASK);
    if at + OVERHEAD + len > frame.len() {
        return Err(MalformedFrame::Length);
    }
    Ok((Datagram { command, index: frame[at + 1], address: u32_at(frame, at + 2), at, len }, length & MORE != 0))
}

/// Builds a frame in a buffer of [`FRAME_MAX`] bytes.
pub struct Builder<'a> {
    frame: &'a mut [u8; FRAME_MAX],
    end: usize,
    last: Option<usize>,
}

impl<'a> Builder<'a> {
    /// Starts an empty frame from this station to all subdevices.
    pub fn new(frame: &'a mut [u8; FRAME_MAX], source: [u8; 6]) -> Builder<'a> {
        frame[..6].fill(0xFF);
        frame[6..12].copy_from_slice(&source);
        frame[12..14].copy_from_slice(&ETHERTYPE.to_be_bytes());
        Builder { frame, end: DATAGRAMS, last: None }
    }

    /// Adds a datagram whose data are zero; returns `None` if the frame is full.
    pub fn add(&mut self, command: Command, index: u8, address: u32, len: usize) -> Option<Datagram> {
        let (at, end) = (self.end, self.end + OVERHEAD + len);
        if end > FRAME_MAX {
            return None;
        }
        if let Some(last) = self.last {
            let length = u16_at(self.frame, last + 6) | MORE;
            put(self.frame, last + 6, &length.to_le_bytes());
        }
        self.frame[at..end].fill(0);
        (self.frame[at], self.frame[at + 1]) = (command as u8, index);
        put(self.frame, at + 2, &address.to_le_bytes());
        put(self.frame, at + 6, &(len as u16).to_le_bytes());
        (self.last, self.end) = (Some(at), end);
        Some(Datagram { command, index, address, at, len })
    }

    /// Stores the length; returns the number of bytes to send.
    pub fn finish(self) -> usize {
        let header = OF_DATAGRAMS | (self.end - DATAGRAMS) as u16;
        put(self.frame, 14, &header.to_le_bytes());
        let padded = self.end.max(FRAME_MIN);
        self.frame[self.end..padded].fill(0);
        padded
    }
}

/// Returns the address of a memory location in a subdevice, which is identified by its position on the line or its station address.
pub fn at(device: u16, memory: u16) -> u32 {
    u32::from(device) | u32::from(memory) << 16
}

/// Returns the auto-increment address of the subdevice at this position on the line. Each subdevice that a frame passes increments it;
/// the subdevice that receives 0 is addressed.
pub fn position(index: usize) -> u16 {
    0u16.wrapping_sub(index as u16)
}

pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

pub(crate) fn put(bytes: &mut [u8], at: usize, what: &[u8]) {
    bytes[at..at + what.len()].copy_from_slice(what);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_as_it_was_built() {
        let mut frame = [0; FRAME_MAX];
        let mut builder = Builder::new(&mut frame, [2; 6]);
        let first = builder.add(Command::AllRead, 1, at(0, 0x130), 2).unwrap();
        let second = builder.add(Command::LogicalReadWrite, 1, 0x1_0000, 100).unwrap();
        assert!(builder.add(Command::AllRead, 2, 0, 1480).is_none(), "there is no room");
        let len = builder.finish();
        assert_eq!(len, DATAGRAMS + 2 + 100 + 2 * OVERHEAD);
        let read: Vec<_> = datagrams(&frame[..len]).unwrap().collect();
        assert_eq!(read, [Ok(first), Ok(second)]);
        assert_eq!(datagrams(&frame[..len - 1]).err(), Some(MalformedFrame::Length));
        assert_eq!(datagrams(&frame[..9]).err(), Some(MalformedFrame::Short));
    }
}
