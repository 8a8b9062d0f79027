// SPDX-License-Identifier: Apache-2.0
//! Reads and writes object dictionary entries of a subdevice through its mailbox.
use super::bus::Bus;
use crate::coe::{self, Entry, Sdo};
use crate::registers as reg;
use crate::sii::SyncManager;
use cia402::abort_name;
use std::time::{Duration, Instant};

/// Time limit for a subdevice to answer.
const PATIENCE: Duration = Duration::from_secs(5);
const LONGEST: usize = 1 << 20;
/// Maximum length of an answer.
const MAILBOX_MAX: usize = 1400;

/// The mailbox of a subdevice.
#[derive(Clone, Debug)]
pub struct Mailbox {
    pub station: u16,
    pub to: SyncManager,
    pub from: SyncManager,
    pub counter: u8,
}

impl Mailbox {
    /// Reads an object dictionary entry.
    ///
    /// # Errors
    /// Fails with a message if the subdevice aborts the transfer or does not answer.
    pub fn upload(&mut self, bus: &mut Bus, of: Entry) -> Result<Vec<u8>, String> {
        let answer = self.exchange(bus, &Sdo::Upload(of))?;
        let (size, mut value) = match coe::response(&answer) {
            Some(Sdo::Uploaded(at, value)) if at == of => return Ok(value.to_vec()),
            Some(Sdo::UploadBegun(at, size, value)) if at == of && size as usize <= LONGEST => (size as usize, value.to_vec()),
            other => return Err(unexpected(of, other)),
        };
        let mut toggle = false;
        loop {
            let answer = self.exchange(bus, &Sdo::UploadNext { toggle })?;
            match coe::response(&answer) {
                Some(Sdo::Segment { toggle: same, last, data }) if same == toggle && value.len() + data.len() <= size => {
                    value.extend_from_slice(data);
                    if last {
                        return Ok(value);
                    }
                }
                other => return Err(unexpected(of, other)),
            }
            toggle = !toggle;
        }
    }

    /// Writes an object dictionary entry.
    ///
    /// # Errors
    /// Fails as [`Mailbox::upload`] does.
    pub fn download(&mut self, bus: &mut Bus, of: Entry, value: &[u8]) -> Result<(), String> {
        let room = self.room()?;
        let first = if value.len() <= 4 { value.len() } else { value.len().min(room - coe::SDO_LEN) };
        let answer = self.exchange(bus, &Sdo::Download(of, value.len() as u32, &value[..first]))?;
        match coe::response(&answer) {
            Some(Sdo::Downloaded(at)) if at == of => {}
            other => return Err(unexpected(of, other)),
        }
        let segment = room - coe::SDO_AT - 1;
        let rest = &value[first..];
        for (number, data) in rest.chunks(segment).enumerate() {
            let toggle = number % 2 == 1;
            let last = (number + 1) * segment >= rest.len();
            let answer = self.exchange(bus, &Sdo::Segment { toggle, last, data })?;
            match coe::response(&answer) {
                Some(Sdo::Taken { toggle: same }) if same == toggle => {}
                other => return Err(unexpected(of, other)),
            }
        }
        Ok(())
    }

    /// Reads an object dictionary entry of up to 4 bytes as a number.
    pub fn number(&mut self, bus: &mut Bus, index: u16, sub: u8) -> Result<u32, String> {
        let value = self.upload(bus, Entry { index, sub })?;
        Ok(value.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte)))
    }

    fn room(&self) -> Result<usize, String> {
        let room = usize::from(self.to.len);
        let fits = (coe::SDO_LEN + 8..=MAILBOX_MAX).contains(&room) && (coe::SDO_LEN..=MAILBOX_MAX).contains(&usize::from(self.from.len));
        if fits { Ok(room) } else { Err(format!("the subdevice with station address {:#06x} has no CoE mailbox", self.station)) }
    }

    /// Sends a message and waits for its answer; other messages are ignored.
    fn exchange(&mut self, bus: &mut Bus, sdo: &Sdo<'_>) -> Result<Vec<u8>, String> {
        let mut mailbox = vec![0; self.room()?];
        self.counter = self.counter % 7 + 1;
        coe::write(&mut mailbox, self.counter, coe::REQUEST, sdo);
        let until = Instant::now() + PATIENCE;
        let late = |what: &str| format!("the mailbox of the subdevice with station address {:#06x} {what}", self.station);
        while !bus.try_write(self.station, self.to.start, &mailbox)? {
            if Instant::now() > until {
                return Err(late("accepts nothing"));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        let status = reg::SYNC_MANAGER + reg::SYNC_MANAGER_LEN + 5;
        while Instant::now() <= until {
            let is_full = bus.read(self.station, status, 1)?[0] & reg::MAILBOX_FULL != 0;
            let came = if is_full { bus.try_read(self.station, self.from.start, self.from.len.into())? } else { None };
            let Some(came) = came else {
                std::thread::sleep(Duration::from_micros(200));
                continue;
            };
            if let Some(read) = coe::message(&came)
                && matches!(read.service, coe::RESPONSE | coe::REQUEST)
            {
                return Ok(read.body.to_vec());
            }
        }
        Err(late("gives no answer"))
    }
}

fn unexpected(of: Entry, answer: Option<Sdo<'_>>) -> String {
    let object = format!("object {:#06x}:{}", of.index, of.sub);
    match answer {
        Some(Sdo::Abort(_, code)) => format!("{object}: the subdevice aborted with {code:#010x}, {}", abort_name(code)),
        other => format!("{object}: the subdevice gave an unexpected answer: {other:?}"),
    }
}
