// SPDX-License-Identifier: Apache-2.0
//! Control messages between hosts, other than values and commands: identity, time, and leaving. All fields are little-endian: an
//! eight-byte checksum, one byte for the kind, then the fields of that kind. A text is a four-byte length followed by UTF-8.
use crate::agreement::ClockOffset;
use crate::secret::{DRAWN_LEN, PROOF_LEN};
use interconnect::message::packet::checksum;

/// Version of the protocol between hosts. Hosts with different versions reject each other.
pub const PROTOCOL_VERSION: u32 = 2;

/// Maximum length of a name, target or reason, bytes.
const TEXT_BYTES_MAX: usize = 1024;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Control {
    /// A host's request to join.
    Hello(Hello),
    /// The host is admitted by the host with this number. `proof` shows that the admitting host has the secret, if one is used.
    Welcome { id: u64, name: String, target: String, proof: [u8; PROOF_LEN] },
    /// The host is not admitted.
    Refusal { reason: String },
    /// Request for the time, with the requesting host's current estimate: the listener's clocks minus its own.
    Ping { from: u64, left_ns: i64, left_wall_ns: i64, offset: Option<ClockOffset> },
    /// The time of the answering host.
    Pong { from: u64, left_ns: i64, left_wall_ns: i64, answered_ns: i64, answered_wall_ns: i64 },
    /// The host is leaving.
    Bye { from: u64 },
}

/// Identity of a host before it is admitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Hello {
    pub(crate) protocol: u32,
    pub(crate) abi: u32,
    /// True if the values are little-endian; they are sent as they are stored in memory.
    pub(crate) little_endian: bool,
    pub(crate) id: u64,
    pub(crate) name: String,
    pub(crate) target: String,
    /// Random challenge for which the listener must prove that it has the secret.
    pub(crate) drawn: [u8; DRAWN_LEN],
}

impl Control {
    pub(crate) fn emit(&self) -> Vec<u8> {
        let mut fields = vec![0; 8];
        match self {
            Control::Hello(hello) => {
                fields.push(1);
                fields.extend(hello.protocol.to_le_bytes());
                fields.extend(hello.abi.to_le_bytes());
                fields.push(u8::from(hello.little_endian));
                fields.extend(hello.id.to_le_bytes());
                put_text(&mut fields, &hello.name);
                put_text(&mut fields, &hello.target);
                fields.extend(hello.drawn);
            }
            Control::Welcome { id, name, target, proof } => {
                fields.push(2);
                fields.extend(id.to_le_bytes());
                put_text(&mut fields, name);
                put_text(&mut fields, target);
                fields.extend(proof);
            }
            Control::Refusal { reason } => {
                fields.push(3);
                put_text(&mut fields, reason);
            }
            Control::Ping { from, left_ns, left_wall_ns, offset } => {
                fields.push(4);
                let known = offset.unwrap_or_default();
                let times = [*left_ns, *left_wall_ns, i64::from(offset.is_some()), known.clock_offset_ns, known.uncertainty_ns, known.wall_offset_ns];
                put_times(&mut fields, *from, &times);
            }
            Control::Pong { from, left_ns, left_wall_ns, answered_ns, answered_wall_ns } => {
                fields.push(5);
                put_times(&mut fields, *from, &[*left_ns, *left_wall_ns, *answered_ns, *answered_wall_ns]);
            }
            Control::Bye { from } => {
                fields.push(6);
                put_times(&mut fields, *from, &[]);
            }
        }
        let sum = checksum(&fields[8..]);
        fields[..8].copy_from_slice(&sum.to_le_bytes());
        fields
    }

    /// Parses a packet; returns `None` if the bytes are damaged.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let (sum, fields) = bytes.split_first_chunk::<8>()?;
        if u64::from_le_bytes(*sum) != checksum(fields) {
            return None;
        }
        let (kind, mut rest) = fields.split_first()?;
        let fields = &mut rest;
        let control = match kind {
            1 => Control::Hello(Hello {
                protocol: take_u32(fields)?,
                abi: take_u32(fields)?,
                little_endian: take_byte(fields)? != 0,
                id: take_u64(fields)?,
                name: take_text(fields)?,
                target: take_text(fields)?,
                drawn: *take(fields)?,
            }),
            2 => Control::Welcome { id: take_u64(fields)?, name: take_text(fields)?, target: take_text(fields)?, proof: *take(fields)? },
            3 => Control::Refusal { reason: take_text(fields)? },
            4 => {
                let (from, [left_ns, left_wall_ns, known, clock_offset_ns, uncertainty_ns, wall_offset_ns]) = take_times(fields)?;
                let offset = (known != 0).then_some(ClockOffset { clock_offset_ns, uncertainty_ns, wall_offset_ns });
                Control::Ping { from, left_ns, left_wall_ns, offset }
            }
            5 => {
                let (from, [left_ns, left_wall_ns, answered_ns, answered_wall_ns]) = take_times(fields)?;
                Control::Pong { from, left_ns, left_wall_ns, answered_ns, answered_wall_ns }
            }
            6 => Control::Bye { from: take_u64(fields)? },
            _ => return None,
        };
        fields.is_empty().then_some(control)
    }
}

fn put_text(fields: &mut Vec<u8>, text: &str) {
    let cut = text.floor_char_boundary(TEXT_BYTES_MAX);
    fields.extend((cut as u32).to_le_bytes());
    fields.extend(&text.as_bytes()[..cut]);
}

fn put_times(fields: &mut Vec<u8>, from: u64, times: &[i64]) {
    fields.extend(from.to_le_bytes());
    times.iter().for_each(|time| fields.extend(time.to_le_bytes()));
}

fn take<'a, const N: usize>(fields: &mut &'a [u8]) -> Option<&'a [u8; N]> {
    let (taken, rest) = fields.split_first_chunk::<N>()?;
    *fields = rest;
    Some(taken)
}

fn take_byte(fields: &mut &[u8]) -> Option<u8> {
    take::<1>(fields).map(|byte| byte[0])
}

fn take_u32(fields: &mut &[u8]) -> Option<u32> {
    take(fields).map(|bytes| u32::from_le_bytes(*bytes))
}

fn take_u64(fields: &mut &[u8]) -> Option<u64> {
    take(fields).map(|bytes| u64::from_le_bytes(*bytes))
}

fn take_text(fields: &mut &[u8]) -> Option<String> {
    let len = take_u32(fields)? as usize;
    let (text, rest) = fields.split_at_checked(len).filter(|_| len <= TEXT_BYTES_MAX)?;
    *fields = rest;
    String::from_utf8(text.to_vec()).ok()
}

fn take_times<const N: usize>(fields: &mut &[u8]) -> Option<(u64, [i64; N])> {
    let from = take_u64(fields)?;
    let mut times = [0; N];
    for time in &mut times {
        *time = take_u64(fields)?.cast_signed();
    }
    Some((from, times))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all() -> Vec<Control> {
        let (name, target) = ("cell-b".to_owned(), "x86_64-unknown-linux-gnu".to_owned());
        let offset = ClockOffset { clock_offset_ns: -3, uncertainty_ns: 2, wall_offset_ns: i64::MIN };
        vec![
            Control::Hello(Hello { protocol: 1, abi: 2, little_endian: true, id: u64::MAX, name: name.clone(), target: target.clone(), drawn: [3; 16] }),
            Control::Welcome { id: 4, name, target, proof: [5; 32] },
            Control::Refusal { reason: "not you, Zoë".to_owned() },
            Control::Ping { from: 1, left_ns: -1, left_wall_ns: 5, offset: Some(offset) },
            Control::Ping { from: 1, left_ns: 0, left_wall_ns: 0, offset: None },
            Control::Pong { from: 2, left_ns: 1, left_wall_ns: 2, answered_ns: 3, answered_wall_ns: 4 },
            Control::Bye { from: 9 },
        ]
    }

    #[test]
    fn what_was_said_is_heard() {
        for control in all() {
            assert_eq!(Control::parse(&control.emit()), Some(control));
        }
    }

    #[test]
    fn a_changed_bit_or_a_cut_end_is_found() {
        for control in all() {
            let bytes = control.emit();
            for bit in 0..bytes.len() * 8 {
                let mut changed = bytes.clone();
                changed[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(Control::parse(&changed), None, "{control:?}, bit {bit}");
            }
            assert!((0..bytes.len()).all(|len| Control::parse(&bytes[..len]).is_none()), "{control:?}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_harm_the_reader(body in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut bytes = checksum(&body).to_le_bytes().to_vec();
            bytes.extend(&body);
            if let Some(control) = Control::parse(&bytes) {
                prop_assert_eq!(Control::parse(&control.emit()), Some(control));
            }
        }
    }
}
