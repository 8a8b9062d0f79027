// SPDX-License-Identifier: Apache-2.0
//! Registers and bits that clients can read, some of which they may also write.
use crate::modbus::map::{MappedChannel, Write};
use crate::modbus::pdu::{Exception, Pdu, Request, Space};
use std::collections::BTreeMap;

/// Cell at one address.
#[derive(Clone, Copy, Debug)]
struct Cell {
    value: u16,
    /// True if a client may write the cell, because the channel is read here.
    is_open: bool,
}

/// Cells at the declared addresses; other addresses do not exist.
#[derive(Debug, Default)]
pub(in crate::modbus) struct Tables {
    cells: BTreeMap<(Space, u16), Cell>,
}

impl Tables {
    pub(in crate::modbus) fn new(places: &[MappedChannel]) -> Tables {
        let mut cells = BTreeMap::new();
        for place in places {
            for at in 0..place.count() {
                cells.insert((place.space, place.address + at), Cell { value: 0, is_open: place.write == Write::Never });
            }
        }
        Tables { cells }
    }

    /// Stores a value of this machine, as the bytes of a channel. NaN changes nothing. Returns false if the value was out of range.
    pub(super) fn put(&mut self, place: &MappedChannel, channel: &[u8]) -> bool {
        let Some((wire, fits)) = place.form.write(channel) else { return false };
        for at in 0..place.count() {
            let Some(cell) = self.cells.get_mut(&(place.space, place.address + at)) else { continue };
            let byte = 2 * usize::from(at);
            let mask = place.form.mask();
            let value = if place.space.is_bits() { u16::from(wire[0]) } else { u16::from_be_bytes([wire[byte], wire[byte + 1]]) };
            cell.value = cell.value & !mask | value & mask;
        }
        fits
    }

    /// Copies the bytes of a channel as a client wrote them.
    pub(super) fn get(&self, place: &MappedChannel, channel: &mut [u8]) {
        let mut wire = [0; 8];
        for (at, two) in (0..place.count()).zip(wire.chunks_exact_mut(2)) {
            let value = self.cells.get(&(place.space, place.address + at)).map_or(0, |cell| cell.value);
            two.copy_from_slice(&value.to_be_bytes());
        }
        match place.space.is_bits() {
            true => channel[0] = wire[1] & 1,
            false => place.form.read(&wire, channel),
        }
    }

    /// Carries out a client's request atomically, and returns the answer.
    pub(in crate::modbus) fn carry_out(&mut self, pdu: &[u8]) -> Result<Pdu, Exception> {
        match Request::decode(pdu)? {
            request @ Request::Read { space, address, count } => self.read(&request, space, address, count),
            Request::Write { space, address, count, data } => {
                let is_open = |at| self.cells.get(&(space, at)).is_some_and(|cell| cell.is_open);
                if !each(address, count)?.all(is_open) {
                    return Err(Exception::ILLEGAL_ADDRESS);
                }
                for (index, at) in each(address, count)?.enumerate() {
                    let value = match space.is_bits() {
                        true => data.get(index / 8).map(|byte| u16::from(byte >> (index % 8) & 1)),
                        false => data.get(2 * index..2 * index + 2).map(|two| u16::from_be_bytes([two[0], two[1]])),
                    };
                    if let (Some(cell), Some(value)) = (self.cells.get_mut(&(space, at)), value) {
                        cell.value = value;
                    }
                }
                // The answer is the request, without the data if there is a count. One register may have been written by either
                // function.
                let mut answer = Pdu::EMPTY;
                answer.put(&pdu[..5]);
                Ok(answer)
            }
            Request::Mask { address, keep, set } => {
                let cell = self.cells.get_mut(&(Space::Holding, address)).filter(|cell| cell.is_open).ok_or(Exception::ILLEGAL_ADDRESS)?;
                cell.value = cell.value & keep | set & !keep;
                let mut answer = Pdu::EMPTY;
                answer.put(pdu);
                Ok(answer)
            }
            Request::Identify { .. } => Ok(identity()),
        }
    }

    fn read(&self, request: &Request<'_>, space: Space, address: u16, count: u16) -> Result<Pdu, Exception> {
        let mut answer = Pdu::EMPTY;
        answer.put(&[request.encode().bytes()[0], space.bytes(count) as u8]);
        let (mut bits, mut filled) = (0_u8, 0);
        for at in each(address, count)? {
            let value = self.cells.get(&(space, at)).ok_or(Exception::ILLEGAL_ADDRESS)?.value;
            if !space.is_bits() {
                answer.put_u16(value);
                continue;
            }
            bits |= ((value & 1) as u8) << filled;
            filled += 1;
            if filled == 8 {
                answer.put(&[bits]);
                (bits, filled) = (0, 0);
            }
        }
        if filled > 0 {
            answer.put(&[bits]);
        }
        Ok(answer)
    }
}

/// Returns the addresses of a range; fails if it exceeds the last address.
fn each(address: u16, count: u16) -> Result<impl Iterator<Item = u16>, Exception> {
    let last = address.checked_add(count.saturating_sub(1)).ok_or(Exception::ILLEGAL_ADDRESS)?;
    Ok(address..=last)
}

fn identity() -> Pdu {
    let mut answer = Pdu::EMPTY;
    let texts = ["OpenGPAC", "modbus_server", env!("CARGO_PKG_VERSION")];
    answer.put(&[0x2B, 0x0E, 1, 1, 0, 0, texts.len() as u8]);
    for (id, text) in texts.iter().enumerate() {
        answer.put(&[id as u8, text.len() as u8]);
        answer.put(text.as_bytes());
    }
    answer
}
