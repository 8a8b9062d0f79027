// SPDX-License-Identifier: Apache-2.0
//! Client side of an SDO transfer, expedited or segmented. These are functions on bytes; none of them blocks.
use cia402::Entry;

/// Maximum length of a value accepted from a node.
const VALUE_MAX: usize = 1 << 20;
/// Abort codes that a client sends.
const TOGGLE: u32 = 0x0503_0000;
pub const TIMEOUT: u32 = 0x0504_0000;
const COMMAND: u32 = 0x0504_0001;
const MEMORY: u32 = 0x0504_0005;
const LENGTH: u32 = 0x0607_0010;

/// A transfer in progress.
#[derive(Debug)]
pub struct Transfer {
    of: Entry,
    doing: Doing,
    toggle: bool,
}

#[derive(Debug)]
enum Doing {
    Upload,
    /// Upload: the bytes received so far, and the total number that the node declared.
    Uploading(Vec<u8>, Option<usize>),
    Download(Vec<u8>),
    /// Download: the value, and the number of bytes already sent.
    Downloading(Vec<u8>, usize),
    Over,
}

/// Effect of an answer on a transfer.
#[derive(Debug, PartialEq, Eq)]
pub enum SdoOutcome {
    /// The transfer continues with this request.
    Next([u8; 8]),
    /// The transfer is complete; an upload returns this value.
    Done(Vec<u8>),
    /// The node aborted the transfer with this code.
    Aborted(u32),
    /// The frame is not an answer to the request; the transfer continues unchanged.
    Strange,
    /// The node violated the protocol; this abort code must be sent to it.
    Broken(u32),
}

impl Transfer {
    /// Starts reading an object dictionary entry; returns the transfer and its first request.
    pub fn upload(of: Entry) -> (Transfer, [u8; 8]) {
        (Transfer { of, doing: Doing::Upload, toggle: false }, framed(0x40, of, [0; 4]))
    }

    /// Starts writing an object dictionary entry; returns the transfer and its first request.
    pub fn download(of: Entry, value: &[u8]) -> (Transfer, [u8; 8]) {
        let len = value.len();
        let request = if (1..=4).contains(&len) {
            let mut four = [0; 4];
            four[..len].copy_from_slice(value);
            framed(0x23 | ((4 - len) as u8) << 2, of, four)
        } else {
            framed(0x21, of, (len as u32).to_le_bytes())
        };
        (Transfer { of, doing: Doing::Download(value.to_vec()), toggle: false }, request)
    }

    /// Processes an answer from the node.
    pub fn answer(&mut self, bytes: &[u8; 8]) -> SdoOutcome {
        let command = bytes[0] >> 5;
        let names = self.names(bytes);
        if bytes[0] == 0x80 && names {
            self.doing = Doing::Over;
            return SdoOutcome::Aborted(four(bytes));
        }
        match std::mem::replace(&mut self.doing, Doing::Over) {
            Doing::Upload if command == 2 && names => self.begun(bytes),
            Doing::Uploading(value, size) if command == 0 => self.segment(value, size, bytes),
            Doing::Download(value) if command == 3 && names && bytes[0] == 0x60 => self.accepted(value),
            Doing::Downloading(value, sent) if command == 1 && bytes[0] & 0x0F == 0 => {
                if (bytes[0] & 0x10 != 0) != self.toggle {
                    SdoOutcome::Broken(TOGGLE)
                } else if sent == value.len() {
                    SdoOutcome::Done(Vec::new())
                } else {
                    self.toggle = !self.toggle;
                    self.next(value, sent)
                }
            }
            unchanged => {
                self.doing = unchanged;
                SdoOutcome::Strange
            }
        }
    }

    /// Returns the frame that aborts the transfer from this side.
    pub fn abort(&self, code: u32) -> [u8; 8] {
        framed(0x80, self.of, code.to_le_bytes())
    }

    fn names(&self, bytes: &[u8; 8]) -> bool {
        u16::from_le_bytes([bytes[1], bytes[2]]) == self.of.index && bytes[3] == self.of.sub
    }

    fn begun(&mut self, bytes: &[u8; 8]) -> SdoOutcome {
        let (is_expedited, is_sized) = (bytes[0] & 2 != 0, bytes[0] & 1 != 0);
        match (is_expedited, is_sized) {
            (true, true) => SdoOutcome::Done(bytes[4..8 - usize::from(bytes[0] >> 2 & 3)].to_vec()),
            (true, false) => SdoOutcome::Done(bytes[4..].to_vec()),
            (false, is_sized) => {
                let size = is_sized.then_some(four(bytes) as usize);
                if size.is_some_and(|size| size > VALUE_MAX) {
                    return SdoOutcome::Broken(MEMORY);
                }
                self.doing = Doing::Uploading(Vec::new(), size);
                SdoOutcome::Next([0x60, 0, 0, 0, 0, 0, 0, 0])
            }
        }
    }

    fn segment(&mut self, mut value: Vec<u8>, size: Option<usize>, bytes: &[u8; 8]) -> SdoOutcome {
        if (bytes[0] & 0x10 != 0) != self.toggle {
            return SdoOutcome::Broken(TOGGLE);
        }
        value.extend_from_slice(&bytes[1..8 - usize::from(bytes[0] >> 1 & 7)]);
        let is_last = bytes[0] & 1 != 0;
        let fits = size.is_none_or(|size| if is_last { value.len() == size } else { value.len() < size });
        if !fits || value.len() > VALUE_MAX {
            return SdoOutcome::Broken(LENGTH);
        }
        if is_last {
            return SdoOutcome::Done(value);
        }
        self.toggle = !self.toggle;
        self.doing = Doing::Uploading(value, size);
        SdoOutcome::Next([if self.toggle { 0x70 } else { 0x60 }, 0, 0, 0, 0, 0, 0, 0])
    }

    fn accepted(&mut self, value: Vec<u8>) -> SdoOutcome {
        match value.len() {
            1..=4 => SdoOutcome::Done(Vec::new()),
            0 => SdoOutcome::Broken(COMMAND),
            _ => self.next(value, 0),
        }
    }

    /// Returns the next segment of a download.
    fn next(&mut self, value: Vec<u8>, sent: usize) -> SdoOutcome {
        let part = &value[sent..value.len().min(sent + 7)];
        let is_last = sent + part.len() == value.len();
        let mut request = [0; 8];
        request[0] = u8::from(self.toggle) << 4 | ((7 - part.len()) as u8) << 1 | u8::from(is_last);
        request[1..=part.len()].copy_from_slice(part);
        let sent = sent + part.len();
        self.doing = Doing::Downloading(value, sent);
        SdoOutcome::Next(request)
    }
}

fn framed(command: u8, of: Entry, four: [u8; 4]) -> [u8; 8] {
    let [low, high] = of.index.to_le_bytes();
    [command, low, high, of.sub, four[0], four[1], four[2], four[3]]
}

fn four(bytes: &[u8; 8]) -> u32 {
    u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]])
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: Entry = Entry { index: 0x1008, sub: 0 };

    #[test]
    fn a_short_value_comes_at_once() {
        let (mut transfer, request) = Transfer::upload(Entry { index: 0x1000, sub: 0 });
        assert_eq!(request, [0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        assert_eq!(transfer.answer(&[0x4B, 0x00, 0x10, 0, 0x92, 0x01, 9, 9]), SdoOutcome::Done(vec![0x92, 0x01]));
    }

    #[test]
    fn a_long_value_comes_in_segments_whose_bit_toggles() {
        let (mut transfer, _) = Transfer::upload(NAME);
        assert_eq!(transfer.answer(&[0x41, 0x08, 0x10, 0, 10, 0, 0, 0]), SdoOutcome::Next([0x60, 0, 0, 0, 0, 0, 0, 0]));
        assert_eq!(transfer.answer(b"\x00emulate"), SdoOutcome::Next([0x70, 0, 0, 0, 0, 0, 0, 0]));
        assert_eq!(transfer.answer(b"\x19d x\0\0\0\0"), SdoOutcome::Done(b"emulated x".to_vec()));
        let (mut transfer, _) = Transfer::upload(NAME);
        transfer.answer(&[0x41, 0x08, 0x10, 0, 10, 0, 0, 0]);
        assert_eq!(transfer.answer(b"\x10emulate"), SdoOutcome::Broken(TOGGLE));
    }

    #[test]
    fn a_long_value_goes_in_segments() {
        let (mut transfer, request) = Transfer::download(NAME, b"conveyor 1");
        assert_eq!(request, [0x21, 0x08, 0x10, 0, 10, 0, 0, 0]);
        assert_eq!(transfer.answer(&[0x60, 0x08, 0x10, 0, 0, 0, 0, 0]), SdoOutcome::Next(*b"\x00conveyo"));
        assert_eq!(transfer.answer(&[0x20, 0, 0, 0, 0, 0, 0, 0]), SdoOutcome::Next(*b"\x19r 1\0\0\0\0"));
        assert_eq!(transfer.answer(&[0x30, 0, 0, 0, 0, 0, 0, 0]), SdoOutcome::Done(vec![]));
    }

    #[test]
    fn an_answer_about_another_object_is_none() {
        let (mut transfer, _) = Transfer::upload(NAME);
        assert_eq!(transfer.answer(&[0x4F, 0x09, 0x10, 0, 1, 0, 0, 0]), SdoOutcome::Strange);
        assert_eq!(transfer.answer(&[0x80, 0x08, 0x10, 0, 0, 0, 2, 6]), SdoOutcome::Aborted(0x0602_0000));
    }
}
