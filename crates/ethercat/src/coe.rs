// SPDX-License-Identifier: Apache-2.0
//! Messages in the mailbox of a subdevice: service data objects (SDOs) of CANopen over EtherCAT (CoE).
use crate::frames::{put, u16_at, u32_at};

pub use cia402::Entry;

/// Length of the mailbox header, and of the CoE header.
const MAILBOX: usize = 6;
/// Minimum length of a message that carries an SDO.
pub const SDO_LEN: usize = MAILBOX + 2 + 8;
/// Offset of the SDO bytes.
pub const SDO_AT: usize = MAILBOX + 2;
const COE: u8 = 3;

/// CoE services.
pub const EMERGENCY: u8 = 1;
pub const REQUEST: u8 = 2;
pub const RESPONSE: u8 = 3;

/// Bits of an SDO command: size indicated, expedited.
const SIZED: u8 = 1;
const EXPEDITED: u8 = 2;
pub const ABORT: u8 = 0x80;

/// Content of an SDO message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sdo<'a> {
    /// Request to read this entry.
    Upload(Entry),
    /// Complete value of the entry.
    Uploaded(Entry, &'a [u8]),
    /// First bytes of a value with this total length.
    UploadBegun(Entry, u32, &'a [u8]),
    /// Request for the next segment.
    UploadNext {
        toggle: bool,
    },
    /// A segment, and whether it is the last; used in both directions.
    Segment {
        toggle: bool,
        last: bool,
        data: &'a [u8],
    },
    /// Request to write this entry: a complete value, or the first bytes of a value with this total length.
    Download(Entry, u32, &'a [u8]),
    Downloaded(Entry),
    /// Confirmation of a segment.
    Taken {
        toggle: bool,
    },
    Abort(Entry, u32),
}

/// A message in a mailbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// Counter of the sender, 1 to 7; 0 if the sender does not count.
    pub counter: u8,
    pub service: u8,
    pub body: &'a [u8],
}

/// Parses a mailbox; returns `None` if it does not contain a CoE message, or is shorter than its header states.
pub fn message(bytes: &[u8]) -> Option<Message<'_>> {
    let header = bytes.get(..SDO_AT)?;
    let len = usize::from(u16_at(header, 0));
    let is_coe = header[5] & 0x0F == COE && len >= 2;
    let body = bytes.get(SDO_AT..MAILBOX + len).filter(|_| is_coe)?;
    Some(Message { counter: header[5] >> 4 & 7, service: header[7] >> 4, body })
}

/// Parses the body of a message with service [`REQUEST`].
pub fn request(body: &[u8]) -> Option<Sdo<'_>> {
    let command = *body.first()?;
    match command >> 5 {
        0 => segment(body),
        1 => download(body),
        // With complete access (bit 4) it would be another request.
        2 if command & 0x10 == 0 => entry(body).map(Sdo::Upload),
        3 => Some(Sdo::UploadNext { toggle: command & 0x10 != 0 }),
        4 => abort(body),
        _ => None,
    }
}

/// Parses the body of a message with service [`RESPONSE`].
pub fn response(body: &[u8]) -> Option<Sdo<'_>> {
    let command = *body.first()?;
    match command >> 5 {
        0 => segment(body),
        1 => Some(Sdo::Taken { toggle: command & 0x10 != 0 }),
        2 => uploaded(body),
        3 => entry(body).map(Sdo::Downloaded),
        4 => abort(body),
        _ => None,
    }
}

fn entry(body: &[u8]) -> Option<Entry> {
    body.get(..8).map(|body| Entry { index: u16_at(body, 1), sub: body[3] })
}

fn abort(body: &[u8]) -> Option<Sdo<'_>> {
    entry(body).map(|of| Sdo::Abort(of, u32_at(body, 4)))
}

fn segment(body: &[u8]) -> Option<Sdo<'_>> {
    let (command, data) = body.split_first()?;
    // The length of a short segment is given as the number of bytes missing from 7.
    let data = if data.len() <= 7 { data.get(..7usize.saturating_sub(usize::from(command >> 1 & 7)))? } else { data };
    Some(Sdo::Segment { toggle: command & 0x10 != 0, last: command & 1 != 0, data })
}

fn expedited(body: &[u8]) -> Option<&[u8]> {
    let command = body[0];
    let len = if command & SIZED == 0 { 4 } else { 4 - usize::from(command >> 2 & 3) };
    body.get(4..4 + len)
}

fn uploaded(body: &[u8]) -> Option<Sdo<'_>> {
    let of = entry(body)?;
    if body[0] & EXPEDITED != 0 {
        return expedited(body).map(|data| Sdo::Uploaded(of, data));
    }
    let (size, data) = (u32_at(body, 4), &body[8..]);
    Some(match data.get(..size as usize) {
        Some(whole) => Sdo::Uploaded(of, whole),
        None => Sdo::UploadBegun(of, size, data),
    })
}

fn download(body: &[u8]) -> Option<Sdo<'_>> {
    let of = entry(body)?;
    if body[0] & 0x10 != 0 {
        return None;
    }
    if body[0] & EXPEDITED != 0 {
        return expedited(body).map(|data| Sdo::Download(of, data.len() as u32, data));
    }
    let size = u32_at(body, 4);
    Some(Sdo::Download(of, size, body[8..].get(..size as usize).unwrap_or(&body[8..])))
}

/// Writes a message into a mailbox; returns the number of bytes used. If data do not fit into the mailbox, they are truncated; this
/// occurs in segments and at the start of a transfer, which contains the total length.
pub fn write(mailbox: &mut [u8], counter: u8, service: u8, sdo: &Sdo<'_>) -> usize {
    let mut len = 8;
    let body = &mut mailbox[SDO_AT..];
    body[..8].fill(0);
    let mut head = |command: u8, of: &Entry, value: u32| {
        body[0] = command;
        put(body, 1, &of.index.to_le_bytes());
        body[3] = of.sub;
        put(body, 4, &value.to_le_bytes());
    };
    let short = |data: &[u8]| data.iter().rev().fold(0u32, |value, byte| value << 8 | u32::from(*byte));
    match sdo {
        Sdo::Upload(of) => head(0x40, of, 0),
        Sdo::Uploaded(of, data) if (1..=4).contains(&data.len()) => head(0x43 | (4 - data.len() as u8) << 2, of, short(data)),
        Sdo::Download(of, size, data) if (1..=4).contains(&data.len()) && *size as usize == data.len() => {
            head(0x23 | (4 - data.len() as u8) << 2, of, short(data))
        }
        Sdo::Uploaded(of, data) => {
            head(0x41, of, data.len() as u32);
            len += append(&mut body[8..], data);
        }
        Sdo::UploadBegun(of, size, data) | Sdo::Download(of, size, data) => {
            head(if matches!(sdo, Sdo::Download(..)) { 0x21 } else { 0x41 }, of, *size);
            len += append(&mut body[8..], data);
        }
        Sdo::UploadNext { toggle } => body[0] = 0x60 | u8::from(*toggle) << 4,
        Sdo::Segment { toggle, last, data } => {
            let lacks = 7usize.saturating_sub(data.len()) as u8;
            body[0] = u8::from(*toggle) << 4 | lacks << 1 | u8::from(*last);
            len = 8.max(1 + append(&mut body[1..], data));
        }
        Sdo::Downloaded(of) => head(0x60, of, 0),
        Sdo::Taken { toggle } => body[0] = 0x20 | u8::from(*toggle) << 4,
        Sdo::Abort(of, code) => head(ABORT, of, *code),
    }
    put(mailbox, 0, &((len + 2) as u16).to_le_bytes());
    mailbox[2..5].fill(0);
    mailbox[5] = COE | counter << 4;
    put(mailbox, 6, &(u16::from(service) << 12).to_le_bytes());
    SDO_AT + len
}

fn append(room: &mut [u8], data: &[u8]) -> usize {
    let len = data.len().min(room.len());
    room[..len].copy_from_slice(&data[..len]);
    len
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const OF: Entry = Entry { index: 0x6064, sub: 1 };

    #[test]
    fn each_message_is_read_as_it_was_written() {
        let long = [7; 100];
        let both = [
            (REQUEST, Sdo::Upload(OF)),
            (REQUEST, Sdo::Download(OF, 2, &[1, 2])),
            (REQUEST, Sdo::Download(OF, 9, &[1; 9])),
            (REQUEST, Sdo::Download(OF, 400, &long)),
            (REQUEST, Sdo::UploadNext { toggle: true }),
            (REQUEST, Sdo::Segment { toggle: false, last: true, data: &[1, 2, 3] }),
            (REQUEST, Sdo::Segment { toggle: true, last: false, data: &long }),
            (REQUEST, Sdo::Abort(OF, 0x0602_0000)),
            (RESPONSE, Sdo::Uploaded(OF, &[1, 2, 3, 4])),
            (RESPONSE, Sdo::Uploaded(OF, &[9; 20])),
            (RESPONSE, Sdo::UploadBegun(OF, 400, &long)),
            (RESPONSE, Sdo::Downloaded(OF)),
            (RESPONSE, Sdo::Taken { toggle: true }),
        ];
        for (service, sdo) in both {
            let mut mailbox = [0; 128];
            let len = write(&mut mailbox, 3, service, &sdo);
            let read = message(&mailbox).unwrap();
            assert_eq!((read.counter, read.service, SDO_AT + read.body.len()), (3, service, len));
            let said = if service == REQUEST { request(read.body) } else { response(read.body) };
            assert_eq!(said, Some(sdo));
        }
    }

    proptest! {
        #[test]
        fn no_bytes_are_too_wrong(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            if let Some(read) = message(&bytes) {
                let _ = (request(read.body), response(read.body));
            }
        }
    }
}
