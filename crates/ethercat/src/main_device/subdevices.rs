// SPDX-License-Identifier: Apache-2.0
//! Subdevices on a segment, and their state changes.
use super::bus::Bus;
use super::sdo::Mailbox;
use crate::frames::{self, Command, u16_at};
use crate::registers as reg;
use crate::sii::{self, Contents, SyncManager};
use crate::states::{self, ERROR, State};
use std::time::{Duration, Instant};

/// Station address of the first subdevice.
const FIRST_STATION: u16 = 0x1001;
/// Time limit for a state change.
const CHANGE: Duration = Duration::from_secs(10);
const EEPROM_PATIENCE: Duration = Duration::from_secs(2);
/// Maximum number of subdevices on a line.
const MOST: usize = 64;

/// A subdevice that was found on the line.
#[derive(Clone, Debug)]
pub struct Subdevice {
    pub position: usize,
    pub station: u16,
    pub contents: Contents,
}

/// Address of the subdevices to access.
#[derive(Clone, Copy)]
enum Which {
    Position(usize),
    Station(u16),
}

impl Subdevice {
    /// Returns the subdevice's name for use in errors.
    pub fn title(&self) -> String {
        format!("subdevice {} '{}'", self.position, self.contents.identity.name)
    }

    /// Returns the mailbox.
    ///
    /// # Errors
    /// Fails with a message if the subdevice has no mailbox.
    pub fn mailbox(&self) -> Result<Mailbox, String> {
        let find = |kind| self.contents.sync_managers.iter().find(|manager| manager.kind == kind).copied();
        match (find(1), find(2)) {
            (Some(to), Some(from)) if self.contents.has_coe => Ok(Mailbox { station: self.station, to, from, counter: 0 }),
            _ => Err(format!("{} has no CoE object dictionary, so it is not a CiA 402 drive", self.title())),
        }
    }

    /// Returns the number and contents of the SyncManager of this kind.
    pub fn sync_manager(&self, kind: u8) -> Option<(u16, SyncManager)> {
        (0..).zip(&self.contents.sync_managers).find(|(_, manager)| manager.kind == kind).map(|(number, manager)| (number, *manager))
    }

    /// Requests a state and waits until it is reached.
    ///
    /// # Errors
    /// Fails with a message that contains the status code reported by the subdevice.
    pub fn change(&self, bus: &mut Bus, to: State) -> Result<(), String> {
        bus.write(self.station, reg::AL_CONTROL, &(to as u16 | ERROR).to_le_bytes())?;
        self.wait(bus, to)
    }

    fn wait(&self, bus: &mut Bus, to: State) -> Result<(), String> {
        let until = Instant::now() + CHANGE;
        loop {
            let registers = bus.read(self.station, reg::AL_STATUS, 6)?;
            let (status, code) = (u16_at(&registers, 0), u16_at(&registers, 4));
            if status & 0x1F == to as u16 {
                return Ok(());
            }
            if status & ERROR != 0 || Instant::now() > until {
                return Err(format!("{} does not go to {to}: it is in {}", self.title(), states::describe(status, code)));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// Returns the contents of the EEPROMs of the subdevices on the line, in order, without changing their states.
///
/// # Errors
/// Fails with a message if no subdevice answers or an EEPROM cannot be read.
pub fn inventory(bus: &mut Bus) -> Result<Vec<Contents>, String> {
    let count = count(bus)?;
    (0..count).map(|position| read_eeprom(bus, Which::Position(position))).collect()
}

/// Takes control of the line: all subdevices go to INIT, are assigned station addresses, and are identified.
///
/// # Errors
/// Fails with a message.
pub fn take(bus: &mut Bus) -> Result<Vec<Subdevice>, String> {
    let count = count(bus)?;
    bus.write_all(reg::AL_CONTROL, &(State::Init as u16 | ERROR).to_le_bytes())?;
    bus.write_all(reg::FMMU, &[0; 8 * reg::FMMU_LEN as usize])?;
    bus.write_all(reg::SYNC_MANAGER, &[0; 8 * reg::SYNC_MANAGER_LEN as usize])?;
    bus.write_all(reg::SYNC_ACTIVATION, &[0])?;
    let mut subdevices = Vec::with_capacity(count);
    for position in 0..count {
        let station = FIRST_STATION + position as u16;
        write(bus, Which::Position(position), reg::STATION, &station.to_le_bytes())?;
        let contents = read_eeprom(bus, Which::Station(station))?;
        let subdevice = Subdevice { position, station, contents };
        subdevice.wait(bus, State::Init)?;
        subdevices.push(subdevice);
    }
    Ok(subdevices)
}

fn count(bus: &mut Bus) -> Result<usize, String> {
    let count = usize::from(bus.ask(Command::AllRead, frames::at(0, reg::AL_STATUS), &[0; 2])?.counter);
    if count <= MOST { Ok(count) } else { Err(format!("{count} subdevices answer, but at most {MOST} are supported")) }
}

fn read(bus: &mut Bus, which: Which, memory: u16, len: usize) -> Result<Vec<u8>, String> {
    let zeros = [0; 8];
    let answer = match which {
        Which::Position(position) => bus.ask(Command::PositionRead, frames::at(frames::position(position), memory), &zeros[..len]),
        Which::Station(station) => bus.ask(Command::StationRead, frames::at(station, memory), &zeros[..len]),
    }?;
    if answer.counter == 1 { Ok(answer.data) } else { Err(gone(which)) }
}

fn write(bus: &mut Bus, which: Which, memory: u16, data: &[u8]) -> Result<(), String> {
    let answer = match which {
        Which::Position(position) => bus.ask(Command::PositionWrite, frames::at(frames::position(position), memory), data),
        Which::Station(station) => bus.ask(Command::StationWrite, frames::at(station, memory), data),
    }?;
    if answer.counter == 1 { Ok(()) } else { Err(gone(which)) }
}

fn gone(which: Which) -> String {
    match which {
        Which::Position(position) => format!("subdevice {position} no longer answers; check its cable and its power"),
        Which::Station(station) => format!("the subdevice with station address {station:#06x} no longer answers; check its cable and its power"),
    }
}

fn read_eeprom(bus: &mut Bus, which: Which) -> Result<Contents, String> {
    // The main device takes the EEPROM, regardless of its previous owner.
    write(bus, which, reg::EEPROM_CONFIG, &[2])?;
    write(bus, which, reg::EEPROM_CONFIG, &[0])?;
    let mut bytes = Vec::new();
    loop {
        while bytes.len() < sii::FIXED || sii::wanted(&bytes).is_some_and(|wanted| bytes.len() < wanted) {
            let more = read_words(bus, which, (bytes.len() / 2) as u32)?;
            bytes.extend(more);
        }
        if sii::wanted(&bytes).is_none() {
            return sii::parse(&bytes).ok_or_else(|| "an EEPROM is too short".to_owned());
        }
    }
}

/// Reads four or eight bytes from an EEPROM, starting at this word.
fn read_words(bus: &mut Bus, which: Which, word: u32) -> Result<Vec<u8>, String> {
    let mut command = [0; 6];
    command[1] = 1;
    command[2..].copy_from_slice(&word.to_le_bytes());
    write(bus, which, reg::EEPROM, &command)?;
    let until = Instant::now() + EEPROM_PATIENCE;
    loop {
        let status = u16_at(&read(bus, which, reg::EEPROM, 2)?, 0);
        let (is_busy, is_wrong) = (status & 0x8000 != 0, status & 0x7800 != 0);
        if !is_busy && !is_wrong {
            return read(bus, which, reg::EEPROM_DATA, if status & 0x0040 != 0 { 8 } else { 4 });
        }
        if !is_busy || Instant::now() > until {
            return Err(format!("{}: its EEPROM cannot be read, status {status:#06x}", gone(which)));
        }
    }
}
