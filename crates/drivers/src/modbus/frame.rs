// SPDX-License-Identifier: Apache-2.0
//! Frames around requests and answers: MBAP on TCP, unit and CRC on a serial line.
//!
//! No function here allocates or panics, whatever the bytes are.
use super::pdu::{MASK_WRITE, PDU_MAX};

/// Length of the header before a PDU on TCP: transaction, protocol, length, unit.
pub(super) const MBAP: usize = 7;
/// Maximum length of a frame of either kind.
pub(super) const FRAME_MAX: usize = MBAP + PDU_MAX;

/// A complete frame on TCP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TcpFrame<'a> {
    pub transaction: u16,
    pub unit: u8,
    pub pdu: &'a [u8],
    /// Length of the frame in bytes.
    pub len: usize,
}

/// Error for bytes that are not a frame; the start of the next frame is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DamagedFrame;

/// Creates a TCP frame, and returns it with its length.
pub(super) fn mbap(transaction: u16, unit: u8, pdu: &[u8]) -> ([u8; FRAME_MAX], usize) {
    let mut frame = [0; FRAME_MAX];
    let len = pdu.len().min(PDU_MAX);
    frame[..2].copy_from_slice(&transaction.to_be_bytes());
    frame[4..6].copy_from_slice(&(len as u16 + 1).to_be_bytes());
    frame[6] = unit;
    frame[MBAP..MBAP + len].copy_from_slice(&pdu[..len]);
    (frame, MBAP + len)
}

/// Returns the frame at the start of the bytes; `None` if it is incomplete.
pub(super) fn framed(bytes: &[u8]) -> Result<Option<TcpFrame<'_>>, DamagedFrame> {
    // Errors are detected before the frame is complete, so that the reader does not wait for the rest of an invalid one.
    if bytes.len() >= 4 && bytes[2..4] != [0, 0] {
        return Err(DamagedFrame);
    }
    let Some((header, rest)) = bytes.split_first_chunk::<MBAP>() else { return Ok(None) };
    let [t0, t1, _, _, l0, l1, unit] = *header;
    // Unit, function, and at most a PDU.
    let length = usize::from(u16::from_be_bytes([l0, l1]));
    if !(2..=PDU_MAX + 1).contains(&length) {
        return Err(DamagedFrame);
    }
    Ok(rest.get(..length - 1).map(|pdu| TcpFrame { transaction: u16::from_be_bytes([t0, t1]), unit, pdu, len: MBAP + pdu.len() }))
}

/// Creates a frame for a serial line, and returns it with its length.
pub(super) fn rtu(unit: u8, pdu: &[u8]) -> ([u8; FRAME_MAX], usize) {
    let mut frame = [0; FRAME_MAX];
    let len = 1 + pdu.len().min(PDU_MAX);
    frame[0] = unit;
    frame[1..len].copy_from_slice(&pdu[..len - 1]);
    let crc = crc16(&frame[..len]);
    frame[len..len + 2].copy_from_slice(&crc.to_le_bytes());
    (frame, len + 2)
}

/// Returns the unit and PDU of a complete frame on a serial line.
pub(super) fn unframed(frame: &[u8]) -> Result<(u8, &[u8]), DamagedFrame> {
    let (body, crc) = frame.split_last_chunk::<2>().ok_or(DamagedFrame)?;
    match body.split_first() {
        Some((unit, pdu)) if !pdu.is_empty() && pdu.len() <= PDU_MAX && crc16(body) == u16::from_le_bytes(*crc) => Ok((*unit, pdu)),
        _ => Err(DamagedFrame),
    }
}

/// Returns the length of an answer on a serial line that begins with these bytes; `None` if there are too few.
pub(super) fn answer_len(begins: &[u8]) -> Result<Option<usize>, DamagedFrame> {
    let Some(function) = begins.get(1) else { return Ok(None) };
    let len = match function {
        1..=4 => begins.get(2).map(|bytes| 3 + usize::from(*bytes) + 2),
        5 | 6 | 15 | 16 => Some(8),
        &MASK_WRITE => Some(10),
        0x2B => identification_len(begins),
        0x80.. => Some(5),
        _ => return Err(DamagedFrame),
    };
    if len.is_some_and(|len| len > FRAME_MAX) { Err(DamagedFrame) } else { Ok(len) }
}

/// Returns the length of an identification answer on a serial line: unit, function, type, code, conformity, more, next, count, the
/// objects, CRC.
fn identification_len(begins: &[u8]) -> Option<usize> {
    let mut at = 8;
    for _ in 0..*begins.get(7)? {
        at += 2 + usize::from(*begins.get(at + 1)?);
    }
    Some(at + 2)
}

/// Computes the CRC-16/MODBUS: polynomial 0x8005, reflected, initial value 0xFFFF.
pub(super) fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        let at = usize::from((crc ^ u16::from(*byte)) & 0xFF);
        (crc >> 8) ^ TABLE[at]
    })
}

const TABLE: [u16; 256] = {
    let mut table = [0; 256];
    let mut at = 0;
    while at < 256 {
        let (mut crc, mut bit) = (at as u16, 0);
        while bit < 8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 };
            bit += 1;
        }
        table[at] = crc;
        at += 1;
    }
    table
};
