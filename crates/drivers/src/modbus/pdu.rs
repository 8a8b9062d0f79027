// SPDX-License-Identifier: Apache-2.0
//! Modbus requests and answers without the frame around them: the PDU of "MODBUS application protocol 1.1b3".
//!
//! No function here allocates or panics, whatever the bytes are.
use std::fmt;

/// Maximum length of a PDU.
pub(super) const PDU_MAX: usize = 253;

/// Function "Mask Write Register".
pub(super) const MASK_WRITE: u8 = 22;

/// Tables of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Space {
    Coil,
    Discrete,
    Input,
    Holding,
}

impl Space {
    pub(super) fn is_bits(self) -> bool {
        matches!(self, Space::Coil | Space::Discrete)
    }

    /// Returns true if a client may write the table.
    pub(super) fn is_written(self) -> bool {
        matches!(self, Space::Coil | Space::Holding)
    }

    /// Returns the maximum number of items that one request reads.
    pub(super) fn read_max(self) -> u16 {
        if self.is_bits() { 2000 } else { 125 }
    }

    /// Returns the maximum number of items that one request writes.
    pub(super) fn write_max(self) -> u16 {
        if self.is_bits() { 1968 } else { 123 }
    }

    fn read_function(self) -> u8 {
        match self {
            Space::Coil => 1,
            Space::Discrete => 2,
            Space::Holding => 3,
            Space::Input => 4,
        }
    }

    fn of_read(function: u8) -> Option<Space> {
        [Space::Coil, Space::Discrete, Space::Holding, Space::Input].into_iter().find(|space| space.read_function() == function)
    }

    /// Returns the number of bytes of `count` items.
    pub(super) fn bytes(self, count: u16) -> usize {
        if self.is_bits() { usize::from(count).div_ceil(8) } else { 2 * usize::from(count) }
    }
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Space::Coil => "coil",
            Space::Discrete => "discrete",
            Space::Input => "input",
            Space::Holding => "holding",
        })
    }
}

/// Request of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request<'a> {
    Read {
        space: Space,
        address: u16,
        count: u16,
    },
    /// Writes items. `data` is in wire order: registers are big-endian, and bits start at the least significant bit of the first byte.
    Write {
        space: Space,
        address: u16,
        count: u16,
        data: &'a [u8],
    },
    /// Changes bits of a holding register within the device: the bits in `keep` are preserved, the others are set to those of `set`.
    Mask {
        address: u16,
        keep: u16,
        set: u16,
    },
    /// Requests the identification of the device, starting from this object.
    Identify {
        from: u8,
    },
}

impl fmt::Display for Request<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |f: &mut fmt::Formatter<'_>, what: &str, space: Space, address: u16, count: u16| match count {
            1 => write!(f, "{what} {space} {address}"),
            _ => write!(f, "{what} {space} {address} to {}", u32::from(address) + u32::from(count) - 1),
        };
        match *self {
            Request::Read { space, address, count } => range(f, "read", space, address, count),
            Request::Write { space, address, count, .. } => range(f, "write", space, address, count),
            Request::Mask { address, .. } => write!(f, "write bits of holding {address}"),
            Request::Identify { .. } => f.write_str("read the identification"),
        }
    }
}

/// Exception code of a device, with its name in the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Exception(pub u8);

impl Exception {
    pub(super) const ILLEGAL_FUNCTION: Exception = Exception(1);
    pub(super) const ILLEGAL_ADDRESS: Exception = Exception(2);
    pub(super) const ILLEGAL_VALUE: Exception = Exception(3);

    /// Returns true if the same request may soon succeed: acknowledge, busy, or no answer from a gateway's target.
    pub(super) fn passes(self) -> bool {
        matches!(self.0, 5 | 6 | 11)
    }
}

impl fmt::Display for Exception {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self.0 {
            1 => "illegal function",
            2 => "illegal data address",
            3 => "illegal data value",
            4 => "server device failure",
            5 => "acknowledge",
            6 => "server device busy",
            8 => "memory parity error",
            10 => "gateway path unavailable",
            11 => "gateway target device failed to respond",
            other => return write!(f, "exception {other}"),
        };
        write!(f, "{name} (exception {})", self.0)
    }
}

/// Reason why a response does not answer the request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoAnswer {
    Refused(Exception),
    /// The function code, the length or the addresses do not match the request.
    Foreign,
}

/// A PDU under construction.
#[derive(Clone, Debug)]
pub(super) struct Pdu {
    bytes: [u8; PDU_MAX],
    len: usize,
}

impl Pdu {
    pub(super) const EMPTY: Pdu = Pdu { bytes: [0; PDU_MAX], len: 0 };

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }

    /// Appends bytes, and drops those that do not fit; no request in this module exceeds the capacity.
    pub(super) fn put(&mut self, more: &[u8]) {
        let end = (self.len + more.len()).min(PDU_MAX);
        self.bytes[self.len..end].copy_from_slice(&more[..end - self.len]);
        self.len = end;
    }

    pub(super) fn put_u16(&mut self, value: u16) {
        self.put(&value.to_be_bytes());
    }
}

impl<'a> Request<'a> {
    /// Encodes the request for sending.
    pub(super) fn encode(&self) -> Pdu {
        let mut pdu = Pdu::EMPTY;
        match *self {
            Request::Read { space, address, count } => {
                pdu.put(&[space.read_function()]);
                pdu.put_u16(address);
                pdu.put_u16(count);
            }
            Request::Write { space, address, count: 1, data } => {
                pdu.put(&[if space.is_bits() { 5 } else { 6 }]);
                pdu.put_u16(address);
                match space.is_bits() {
                    true => pdu.put_u16(if data.first().is_some_and(|bits| bits & 1 != 0) { 0xFF00 } else { 0 }),
                    false => pdu.put(&data[..data.len().min(2)]),
                }
            }
            Request::Write { space, address, count, data } => {
                pdu.put(&[if space.is_bits() { 15 } else { 16 }]);
                pdu.put_u16(address);
                pdu.put_u16(count);
                pdu.put(&[data.len() as u8]);
                pdu.put(data);
            }
            Request::Mask { address, keep, set } => {
                pdu.put(&[MASK_WRITE]);
                [address, keep, set].into_iter().for_each(|word| pdu.put_u16(word));
            }
            Request::Identify { from } => pdu.put(&[0x2B, 0x0E, 1, from]),
        }
        pdu
    }

    /// Decodes a request to a device; returns an exception if it is malformed.
    pub(super) fn decode(pdu: &'a [u8]) -> Result<Request<'a>, Exception> {
        let (function, rest) = pdu.split_first().ok_or(Exception::ILLEGAL_FUNCTION)?;
        let word = |at: usize| rest.get(at..at + 2).map(|two| u16::from_be_bytes([two[0], two[1]])).ok_or(Exception::ILLEGAL_VALUE);
        match function {
            1..=4 => {
                let space = Space::of_read(*function).ok_or(Exception::ILLEGAL_FUNCTION)?;
                let (address, count) = (word(0)?, word(2)?);
                let fits = rest.len() == 4 && (1..=space.read_max()).contains(&count);
                if fits { Ok(Request::Read { space, address, count }) } else { Err(Exception::ILLEGAL_VALUE) }
            }
            5 | 6 => {
                let address = word(0)?;
                let data = rest.get(2..4).filter(|_| rest.len() == 4).ok_or(Exception::ILLEGAL_VALUE)?;
                match (function, data) {
                    (6, data) => Ok(Request::Write { space: Space::Holding, address, count: 1, data }),
                    (_, [0xFF, 0]) => Ok(Request::Write { space: Space::Coil, address, count: 1, data: &[1] }),
                    (_, [0, 0]) => Ok(Request::Write { space: Space::Coil, address, count: 1, data: &[0] }),
                    _ => Err(Exception::ILLEGAL_VALUE),
                }
            }
            15 | 16 => {
                let space = if *function == 15 { Space::Coil } else { Space::Holding };
                let (address, count) = (word(0)?, word(2)?);
                let (length, data) = rest.get(4..).and_then(<[u8]>::split_first).ok_or(Exception::ILLEGAL_VALUE)?;
                let fits = (1..=space.write_max()).contains(&count) && usize::from(*length) == data.len() && data.len() == space.bytes(count);
                if fits { Ok(Request::Write { space, address, count, data }) } else { Err(Exception::ILLEGAL_VALUE) }
            }
            &MASK_WRITE => {
                let (address, keep, set) = (word(0)?, word(2)?, word(4)?);
                if rest.len() == 6 { Ok(Request::Mask { address, keep, set }) } else { Err(Exception::ILLEGAL_VALUE) }
            }
            0x2B => match rest {
                [0x0E, 1..=4, from] => Ok(Request::Identify { from: *from }),
                _ => Err(Exception::ILLEGAL_FUNCTION),
            },
            _ => Err(Exception::ILLEGAL_FUNCTION),
        }
    }

    /// Returns the data of a device's answer to this request: the bits or registers of a read, the objects of an identification, or
    /// nothing for a write.
    pub(super) fn answer<'b>(&self, pdu: &'b [u8]) -> Result<&'b [u8], NoAnswer> {
        let function = self.encode().bytes[0];
        match (*self, pdu) {
            (_, [refused, code]) if *refused == function | 0x80 => Err(NoAnswer::Refused(Exception(*code))),
            (Request::Read { space, count, .. }, [same, length, data @ ..])
                if *same == function && usize::from(*length) == data.len() && data.len() == space.bytes(count) =>
            {
                Ok(data)
            }
            (Request::Write { count: 1, .. }, echo) if echo == self.encode().bytes() => Ok(&[]),
            (Request::Write { count: 2.., .. }, echo) if echo.len() == 5 && echo == &self.encode().bytes[..5] => Ok(&[]),
            (Request::Mask { .. }, echo) if echo == self.encode().bytes() => Ok(&[]),
            (Request::Identify { .. }, [0x2B, 0x0E, 1, objects @ ..]) => Ok(objects),
            _ => Err(NoAnswer::Foreign),
        }
    }
}

/// Returns the answer by which a device refuses a request.
pub(super) fn refusal(function: u8, why: Exception) -> Pdu {
    let mut pdu = Pdu::EMPTY;
    pdu.put(&[function | 0x80, why.0]);
    pdu
}

/// Returns the objects of an identification, each as `(id, text)`, and the object at which to continue.
pub(super) fn objects(data: &[u8]) -> (impl Iterator<Item = (u8, &[u8])>, Option<u8>) {
    let (more, count, mut rest) = match data {
        [_conformity, more, next, count, rest @ ..] => ((*more == 0xFF).then_some(*next), *count, rest),
        _ => (None, 0, &[][..]),
    };
    let each = (0..count).map_while(move |_| {
        let ([id, length], after) = rest.split_first_chunk::<2>()?;
        let (text, after) = after.split_at_checked(usize::from(*length))?;
        rest = after;
        Some((*id, text))
    });
    (each, more)
}
