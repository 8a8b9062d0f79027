// SPDX-License-Identifier: Apache-2.0
//! The SDO server of an emulated node.
use cia402::Entry;
use cia402::emulated::Objects;

/// Abort codes.
const TOGGLE: u32 = 0x0503_0000;
const COMMAND: u32 = 0x0504_0001;
const LENGTH: u32 = 0x0607_0010;
const IN_USE: u32 = 0x0800_0022;
const TOO_LONG: u32 = 0x0604_0042;
const NOT_SAVED: u32 = 0x0800_0020;
/// Maximum length of a value that the server accepts.
const VALUE_MAX: usize = 256;
/// Signature "save" expected by the object that stores all others.
const SAVE: [u8; 4] = *b"save";

/// Server that transfers one object at a time.
#[derive(Default)]
pub(super) struct Server {
    doing: Doing,
    toggle: bool,
}

#[derive(Default)]
enum Doing {
    #[default]
    Nothing,
    /// Upload: the value, and the number of bytes already sent.
    Upload(Entry, Vec<u8>, usize),
    /// Download: the bytes already received, and the number still missing.
    Download(Entry, Vec<u8>, usize),
}

impl Server {
    /// Answers a request; returns `None` if the request needs no answer.
    pub fn answer(&mut self, objects: &mut Objects, request: &[u8; 8]) -> Option<[u8; 8]> {
        let of = Entry { index: u16::from_le_bytes([request[1], request[2]]), sub: request[3] };
        let about = match (&self.doing, request[0] >> 5) {
            (Doing::Upload(of, ..) | Doing::Download(of, ..), 0 | 3) => *of,
            _ => of,
        };
        let answered = match request[0] >> 5 {
            4 => {
                self.doing = Doing::Nothing;
                return None;
            }
            2 => self.upload(objects, of),
            3 => self.upload_next(request),
            1 => self.download(objects, of, request),
            0 => self.download_next(objects, request),
            _ => Err(COMMAND),
        };
        Some(answered.unwrap_or_else(|code| {
            self.doing = Doing::Nothing;
            framed(0x80, about, code.to_le_bytes())
        }))
    }

    fn upload(&mut self, objects: &Objects, of: Entry) -> Result<[u8; 8], u32> {
        let value = objects.value(objects.find(of)?);
        let len = value.len();
        if (1..=4).contains(&len) {
            let mut four = [0; 4];
            four[..len].copy_from_slice(value);
            return Ok(framed(0x43 | ((4 - len) as u8) << 2, of, four));
        }
        (self.doing, self.toggle) = (Doing::Upload(of, value.to_vec(), 0), false);
        Ok(framed(0x41, of, (len as u32).to_le_bytes()))
    }

    fn upload_next(&mut self, request: &[u8; 8]) -> Result<[u8; 8], u32> {
        let Doing::Upload(_, value, sent) = &mut self.doing else { return Err(COMMAND) };
        if (request[0] & 0x10 != 0) != self.toggle {
            return Err(TOGGLE);
        }
        let part = &value[*sent..value.len().min(*sent + 7)];
        *sent += part.len();
        let is_last = *sent == value.len();
        let mut answer = [0; 8];
        answer[0] = u8::from(self.toggle) << 4 | ((7 - part.len()) as u8) << 1 | u8::from(is_last);
        answer[1..=part.len()].copy_from_slice(part);
        self.toggle = !self.toggle;
        if is_last {
            self.doing = Doing::Nothing;
        }
        Ok(answer)
    }

    fn download(&mut self, objects: &mut Objects, of: Entry, request: &[u8; 8]) -> Result<[u8; 8], u32> {
        if request[0] & 2 != 0 {
            let unused = if request[0] & 1 != 0 { usize::from(request[0] >> 2 & 3) } else { 0 };
            store(objects, of, &request[4..8 - unused])?;
        } else {
            let size = u32::from_le_bytes([request[4], request[5], request[6], request[7]]) as usize;
            if size > VALUE_MAX {
                return Err(LENGTH);
            }
            (self.doing, self.toggle) = (Doing::Download(of, Vec::new(), size), false);
        }
        Ok(framed(0x60, of, [0; 4]))
    }

    fn download_next(&mut self, objects: &mut Objects, request: &[u8; 8]) -> Result<[u8; 8], u32> {
        let Doing::Download(of, value, size) = &mut self.doing else { return Err(COMMAND) };
        if (request[0] & 0x10 != 0) != self.toggle {
            return Err(TOGGLE);
        }
        value.extend_from_slice(&request[1..8 - usize::from(request[0] >> 1 & 7)]);
        let is_last = request[0] & 1 != 0;
        if value.len() > *size || is_last && value.len() != *size {
            return Err(LENGTH);
        }
        if is_last {
            store(objects, *of, value)?;
            self.doing = Doing::Nothing;
        }
        let answer = [0x20 | u8::from(self.toggle) << 4, 0, 0, 0, 0, 0, 0, 0];
        self.toggle = !self.toggle;
        Ok(answer)
    }
}

/// Stores a value. By the rules of CiA 301 for PDOs, a mapping may be changed only while its PDO is disabled.
fn store(objects: &mut Objects, of: Entry, value: &[u8]) -> Result<(), u32> {
    let bits = |objects: &Objects, index, sub| objects.find(Entry { index, sub }).map_or(0, |at| objects.bits(at));
    match of.index {
        0x1600..=0x1603 | 0x1A00..=0x1A03 => {
            let is_used = bits(objects, of.index - 0x200, 1) & 0x8000_0000 == 0;
            if is_used || of.sub > 0 && bits(objects, of.index, 0) != 0 {
                return Err(IN_USE);
            }
            let total: u32 = (1..=value.first().copied().unwrap_or(0).min(8)).map(|sub| bits(objects, of.index, sub) & 0xFF).sum();
            if of.sub == 0 && total > 64 {
                return Err(TOO_LONG);
            }
        }
        0x1010 if of.sub > 0 => return if value == SAVE { Ok(()) } else { Err(NOT_SAVED) },
        _ => {}
    }
    objects.write(of, value, true)
}

fn framed(command: u8, of: Entry, four: [u8; 4]) -> [u8; 8] {
    let [low, high] = of.index.to_le_bytes();
    [command, low, high, of.sub, four[0], four[1], four[2], four[3]]
}
