// SPDX-License-Identifier: Apache-2.0
//! Mailbox server of an emulated subdevice.
use crate::coe::{self, Entry, Sdo};
use cia402::emulated::Objects;

/// Maximum length of the mailbox's answers, bytes.
pub const MAILBOX_LEN: usize = 128;
/// Number of value bytes in the first message of a transfer, and in a segment.
const FIRST: usize = MAILBOX_LEN - coe::SDO_LEN;
const SEGMENT: usize = MAILBOX_LEN - coe::SDO_AT - 1;
/// Maximum length of a value; longer values are refused.
const LONGEST: usize = 4096;
const NO_COMMAND: u32 = 0x0504_0001;
const TOGGLE: u32 = 0x0503_0000;
const TOO_LONG: u32 = 0x0607_0012;

/// A value that is being transferred in segments.
struct Transfer {
    of: Entry,
    value: Vec<u8>,
    done: usize,
    toggle: bool,
}

/// Mailbox server that transfers one object at a time.
pub struct SdoServer {
    transfer: Option<Transfer>,
    last_counter: u8,
    counter: u8,
}

impl SdoServer {
    pub fn new() -> SdoServer {
        SdoServer { transfer: None, last_counter: 0, counter: 0 }
    }

    /// Answers a message; returns `None` if it needs no answer.
    pub fn answer(&mut self, objects: &mut Objects, message: &[u8], in_preop: bool, reply: &mut [u8; MAILBOX_LEN]) -> Option<()> {
        let read = coe::message(message)?;
        let is_again = read.counter != 0 && read.counter == self.last_counter;
        self.last_counter = read.counter;
        if is_again || read.service != coe::REQUEST {
            return None;
        }
        self.counter = self.counter % 7 + 1;
        let Some(request) = coe::request(read.body) else {
            coe::write(reply, self.counter, coe::REQUEST, &Sdo::Abort(Entry { index: 0, sub: 0 }, NO_COMMAND));
            return Some(());
        };
        match self.carry_out(objects, request, in_preop, reply) {
            Ok(()) => {}
            Err((of, code)) => {
                self.transfer = None;
                coe::write(reply, self.counter, coe::REQUEST, &Sdo::Abort(of, code));
            }
        }
        Some(())
    }

    fn carry_out(&mut self, objects: &mut Objects, request: Sdo<'_>, in_preop: bool, reply: &mut [u8; MAILBOX_LEN]) -> Result<(), (Entry, u32)> {
        let counter = self.counter;
        let mut say = |sdo: &Sdo<'_>| {
            coe::write(reply, counter, coe::RESPONSE, sdo);
        };
        match request {
            Sdo::Upload(of) => {
                let value = objects.value(objects.find(of).map_err(|code| (of, code))?);
                if value.len() <= FIRST {
                    say(&Sdo::Uploaded(of, value));
                } else {
                    say(&Sdo::UploadBegun(of, value.len() as u32, &value[..FIRST]));
                    self.transfer = Some(Transfer { of, value: value.to_vec(), done: FIRST, toggle: false });
                }
            }
            Sdo::UploadNext { toggle } => {
                let transfer = self.next(toggle)?;
                let end = (transfer.done + SEGMENT).min(transfer.value.len());
                let last = end == transfer.value.len();
                say(&Sdo::Segment { toggle, last, data: &transfer.value[transfer.done..end] });
                transfer.done = end;
                if last {
                    self.transfer = None;
                }
            }
            Sdo::Download(of, size, data) if size as usize == data.len() => {
                objects.write(of, data, in_preop).map_err(|code| (of, code))?;
                say(&Sdo::Downloaded(of));
            }
            Sdo::Download(of, size, data) => {
                if size as usize > LONGEST {
                    return Err((of, TOO_LONG));
                }
                self.transfer = Some(Transfer { of, value: data.to_vec(), done: size as usize, toggle: false });
                say(&Sdo::Downloaded(of));
            }
            Sdo::Segment { toggle, last, data } => {
                let transfer = self.next(toggle)?;
                transfer.value.extend_from_slice(data);
                let of = transfer.of;
                if transfer.value.len() > transfer.done {
                    return Err((of, TOO_LONG));
                }
                if last {
                    objects.write(of, &transfer.value, in_preop).map_err(|code| (of, code))?;
                    self.transfer = None;
                }
                say(&Sdo::Taken { toggle });
            }
            Sdo::Abort(..) => self.transfer = None,
            _ => return Err((Entry { index: 0, sub: 0 }, NO_COMMAND)),
        }
        Ok(())
    }

    /// Returns the transfer if it continues with this toggle bit.
    fn next(&mut self, toggle: bool) -> Result<&mut Transfer, (Entry, u32)> {
        let transfer = self.transfer.as_mut().ok_or((Entry { index: 0, sub: 0 }, NO_COMMAND))?;
        if transfer.toggle != toggle {
            return Err((transfer.of, TOGGLE));
        }
        transfer.toggle = !toggle;
        Ok(transfer)
    }
}
