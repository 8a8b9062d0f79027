// SPDX-License-Identifier: Apache-2.0
//! RTDE messages, protocol version 2: a length, a message type, and a payload that depends on the type. All numbers are big-endian.
//!
//! Decoding never panics or allocates: any input yields either a message or [`MalformedMessage`].

/// RTDE port of the controller.
pub(super) const PORT: u16 = 30004;
pub(super) const PROTOCOL: u16 = 2;
const HEADER_LEN: usize = 3;

/// Message types.
pub(super) mod kind {
    pub const VERSION: u8 = b'V';
    pub const CONTROLLER: u8 = b'v';
    pub const TEXT: u8 = b'M';
    pub const DATA: u8 = b'U';
    pub const OUTPUTS: u8 = b'O';
    pub const INPUTS: u8 = b'I';
    pub const START: u8 = b'S';
    pub const PAUSE: u8 = b'P';
}

/// Message of a controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Message<'a> {
    /// Answer to the request for a protocol version: true if the controller supports it.
    Version(bool),
    /// Version of the controller: major, minor, bug fix, build.
    Controller([u32; 4]),
    Text {
        text: &'a str,
        source: &'a str,
        /// Level: 0 exception, 1 error, 2 warning, 3 information.
        level: u8,
    },
    /// Types of the requested outputs, separated by commas.
    Outputs {
        recipe: u8,
        types: &'a str,
    },
    Inputs {
        recipe: u8,
        types: &'a str,
    },
    Started(bool),
    Paused(bool),
    Data {
        recipe: u8,
        values: &'a [u8],
    },
}

/// Bytes that are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum MalformedMessage {
    #[error("a message declares a length of {0} bytes")]
    Length(u16),
    #[error("a message has the unknown type {0}")]
    Kind(u8),
    #[error("a message of type {kind} has {len} bytes, which does not match its type")]
    Contents { kind: u8, len: usize },
}

/// Returns the message at the start of `bytes`, and its length; `None` if more bytes are needed.
pub(super) fn decode(bytes: &[u8]) -> Result<Option<(Message<'_>, usize)>, MalformedMessage> {
    let [high, low, kind, rest @ ..] = bytes else { return Ok(None) };
    let said = u16::from_be_bytes([*high, *low]);
    let Some(len) = usize::from(said).checked_sub(HEADER_LEN) else { return Err(MalformedMessage::Length(said)) };
    match rest.get(..len) {
        Some(contents) => Ok(Some((message(*kind, contents)?, usize::from(said)))),
        // More bytes do not make an invalid kind valid.
        None if message(*kind, &[]) == Err(MalformedMessage::Kind(*kind)) => Err(MalformedMessage::Kind(*kind)),
        None => Ok(None),
    }
}

fn message(kind: u8, contents: &[u8]) -> Result<Message<'_>, MalformedMessage> {
    let wrong = MalformedMessage::Contents { kind, len: contents.len() };
    let text = |bytes| std::str::from_utf8(bytes).map_err(|_| wrong);
    match (kind, contents) {
        (kind::VERSION, [accepted]) => Ok(Message::Version(*accepted != 0)),
        (kind::CONTROLLER, _) if contents.len() == 16 => {
            let mut fields = Fields(contents);
            Ok(Message::Controller([fields.u32(), fields.u32(), fields.u32(), fields.u32()]))
        }
        (kind::TEXT, [len, rest @ ..]) => {
            let (first, rest) = rest.split_at_checked(usize::from(*len)).ok_or(wrong)?;
            let [len, rest @ ..] = rest else { return Err(wrong) };
            let (source, rest) = rest.split_at_checked(usize::from(*len)).ok_or(wrong)?;
            let [level] = rest else { return Err(wrong) };
            Ok(Message::Text { text: text(first)?, source: text(source)?, level: *level })
        }
        (kind::OUTPUTS, [recipe, types @ ..]) => Ok(Message::Outputs { recipe: *recipe, types: text(types)? }),
        (kind::INPUTS, [recipe, types @ ..]) => Ok(Message::Inputs { recipe: *recipe, types: text(types)? }),
        (kind::START, [accepted]) => Ok(Message::Started(*accepted != 0)),
        (kind::PAUSE, [accepted]) => Ok(Message::Paused(*accepted != 0)),
        (kind::DATA, [recipe, values @ ..]) => Ok(Message::Data { recipe: *recipe, values }),
        (kind::VERSION | kind::CONTROLLER | kind::TEXT | kind::OUTPUTS | kind::INPUTS | kind::START | kind::PAUSE | kind::DATA, _) => Err(wrong),
        _ => Err(MalformedMessage::Kind(kind)),
    }
}

/// Creates a request.
pub(super) fn request(kind: u8, contents: &[u8]) -> Vec<u8> {
    let len = u16::try_from(HEADER_LEN + contents.len()).expect("requests are lists of some names");
    [&len.to_be_bytes()[..], &[kind], contents].concat()
}

/// Values of a data package, read in sequence. Reads past the end return zero, because the caller has checked the length.
pub(super) struct Fields<'a>(pub &'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let Some((first, rest)) = self.0.split_first_chunk::<N>() else { return [0; N] };
        self.0 = rest;
        *first
    }

    pub fn double(&mut self) -> f64 {
        f64::from_be_bytes(self.take())
    }

    pub fn doubles<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.double())
    }

    pub fn i32(&mut self) -> i32 {
        i32::from_be_bytes(self.take())
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_be_bytes(self.take())
    }

    pub fn u64(&mut self) -> u64 {
        u64::from_be_bytes(self.take())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_kind_is_read() {
        assert_eq!(decode(&[0, 4, b'V', 1]), Ok(Some((Message::Version(true), 4))));
        let text = [0, 3 + 9, b'M', 2, b'n', b'o', 4, b'R', b'T', b'D', b'E', 1];
        assert_eq!(decode(&text), Ok(Some((Message::Text { text: "no", source: "RTDE", level: 1 }, 12))));
        assert_eq!(decode(&request(kind::OUTPUTS, b"\x01DOUBLE")), Ok(Some((Message::Outputs { recipe: 1, types: "DOUBLE" }, 10))));
        let version = [[0, 0, 0, 5], [0, 0, 0, 12], [0; 4], [0, 1, 0, 0]].concat();
        assert_eq!(decode(&request(kind::CONTROLLER, &version)), Ok(Some((Message::Controller([5, 12, 0, 65536]), 19))));
        assert_eq!(decode(&[0, 5, b'U', 1, 7, 99]), Ok(Some((Message::Data { recipe: 1, values: &[7] }, 5))), "what follows is left");
    }

    #[test]
    fn what_is_no_message_is_refused_as_soon_as_that_is_known() {
        assert_eq!(decode(&[0, 2, b'V']), Err(MalformedMessage::Length(2)));
        assert_eq!(decode(&[0, 9, b'?']), Err(MalformedMessage::Kind(b'?')));
        assert_eq!(decode(&[0, 5, b'S', 1, 1]), Err(MalformedMessage::Contents { kind: b'S', len: 2 }));
        assert_eq!(decode(&[0, 6, b'M', 9, b'x', 0]), Err(MalformedMessage::Contents { kind: b'M', len: 3 }));
        assert_eq!(decode(&[0, 4, b'S']), Ok(None));
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_a_message_or_a_refusal(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            if let Ok(Some((message, len))) = decode(&bytes) {
                prop_assert!((HEADER_LEN..=bytes.len()).contains(&len));
                if let Message::Data { values, .. } = message {
                    prop_assert_eq!(values.len(), len - HEADER_LEN - 1);
                }
            }
        }

        #[test]
        fn a_message_with_one_changed_byte_is_no_panic(at in 0usize..64, to in any::<u8>()) {
            let mut bytes = request(kind::TEXT, b"\x05hello\x04RTDE\x02");
            let at = at % bytes.len();
            bytes[at] = to;
            let _ = decode(&bytes);
        }
    }
}
