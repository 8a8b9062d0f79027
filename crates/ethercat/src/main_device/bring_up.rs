// SPDX-License-Identifier: Apache-2.0
//! Brings subdevices from whatever state they are in to SAFEOP, with their process data where the cycle will look for them.
use super::bus::Bus;
use super::clocks::{self, Clocks, Reference};
use super::mapping::{self, Mapping};
use super::subdevices::Subdevice;
use crate::coe::Entry;
use crate::registers as reg;
use crate::sii::SyncManager;
use crate::states::State;

/// A unit of the watchdog, ns: divider 2498 of a clock of 25 MHz.
const WATCHDOG_UNIT_NS: i64 = 100_000;
const WATCHDOG_DIVIDER: u16 = 2498;
const FMMU_READS: u8 = 1;
const FMMU_WRITES: u8 = 2;

/// Which objects a subdevice exchanges.
#[derive(Clone, Debug)]
pub enum Pdos {
    /// Those that it has.
    Device,
    /// These: index, subindex and bits in a number each, outputs and inputs.
    Written(Vec<u32>, Vec<u32>),
}

/// A subdevice that exchanges process data, and where they lie in those of all.
#[derive(Clone, Debug)]
pub struct Station {
    pub subdevice: Subdevice,
    pub mapping: Mapping,
    /// Bytes from the start of all process data.
    pub outputs_at: usize,
    pub inputs_at: usize,
}

/// What is wanted of a subdevice.
pub struct Wanted<'a> {
    pub position: usize,
    pub pdos: &'a Pdos,
    /// Objects that are written in PREOP: entry and value. One that the subdevice does not have is left out where it may be.
    pub settings: &'a [(Entry, Vec<u8>, bool)],
}

/// What was brought up: the subdevices in the order in which they were wanted, and how many bytes of outputs and inputs all have.
pub struct Line {
    pub stations: Vec<Station>,
    pub outputs: usize,
    pub inputs: usize,
    pub reference: Option<Reference>,
    /// When SYNC0 of all has begun, in the time of all.
    pub synced_from_ns: Option<u64>,
}

/// Brings the wanted subdevices of a line that was taken to SAFEOP, with their clocks and SYNC0 where `clocks` are given.
///
/// # Errors
/// For people: each names the subdevice.
pub fn bring_up(bus: &mut Bus, found: &[Subdevice], wanted: &[Wanted<'_>], watchdog_ns: i64, clocks: Option<&Clocks<'_>>) -> Result<Line, String> {
    let reference = clocks.map(|clocks| clocks::synchronise(bus, found, clocks)).transpose()?;
    let mut stations = Vec::with_capacity(wanted.len());
    for want in wanted {
        let missing = || format!("there is no subdevice {}: {} answer; look at the cables and at the power of those behind", want.position, found.len());
        let subdevice = found.get(want.position).ok_or_else(missing)?;
        let mapping = to_pre_op(bus, subdevice, want).map_err(|error| named(subdevice, &error))?;
        stations.push(Station { subdevice: subdevice.clone(), mapping, outputs_at: 0, inputs_at: 0 });
    }
    let mut end = 0;
    for station in &mut stations {
        station.outputs_at = end;
        end += station.mapping.bytes().0;
    }
    let outputs = end;
    for station in &mut stations {
        station.inputs_at = end;
        end += station.mapping.bytes().1;
    }
    let mut synced_from_ns = None;
    for station in &stations {
        let begins_ns = to_safe_op(bus, station, watchdog_ns, clocks).map_err(|error| named(&station.subdevice, &error))?;
        synced_from_ns = synced_from_ns.max(begins_ns);
    }
    Ok(Line { stations, outputs, inputs: end - outputs, reference, synced_from_ns })
}

fn named(subdevice: &Subdevice, error: &str) -> String {
    if error.starts_with("subdevice") { error.to_owned() } else { format!("{}: {error}", subdevice.title()) }
}

fn to_pre_op(bus: &mut Bus, subdevice: &Subdevice, want: &Wanted<'_>) -> Result<Mapping, String> {
    let mut mailbox = subdevice.mailbox()?;
    for (number, manager) in (0..).zip([mailbox.to, mailbox.from]) {
        set_sync_manager(bus, subdevice.station, number, &manager, manager.len)?;
    }
    subdevice.change(bus, State::PreOp)?;
    for (of, value, is_optional) in want.settings {
        let done = mailbox.download(bus, *of, value);
        if !is_optional {
            done?;
        }
    }
    if let Pdos::Written(outputs, inputs) = want.pdos {
        mapping::write(bus, &mut mailbox, outputs, inputs)?;
    }
    mapping::read(bus, &mut mailbox)
}

fn to_safe_op(bus: &mut Bus, station: &Station, watchdog_ns: i64, clocks: Option<&Clocks<'_>>) -> Result<Option<u64>, String> {
    let (subdevice, (outputs, inputs)) = (&station.subdevice, station.mapping.bytes());
    let to = subdevice.station;
    // 0 switches it off.
    let units = if watchdog_ns == 0 { 0 } else { (watchdog_ns / WATCHDOG_UNIT_NS).clamp(1, u16::MAX.into()) as u16 };
    bus.write(to, reg::WATCHDOG_DIVIDER, &WATCHDOG_DIVIDER.to_le_bytes())?;
    bus.write(to, reg::WATCHDOG_OUTPUTS, &units.to_le_bytes())?;
    for (fmmu, kind, len, at) in [(FMMU_WRITES, 3, outputs, station.outputs_at), (FMMU_READS, 4, inputs, station.inputs_at)] {
        if len == 0 {
            continue;
        }
        let (number, manager) = subdevice.sync_manager(kind).ok_or("its EEPROM names no SyncManager for process data")?;
        // The watchdog of outputs is on, whatever the EEPROM says.
        let control = if kind == 3 { manager.control | 0x40 } else { manager.control };
        set_sync_manager(bus, to, number, &SyncManager { control, ..manager }, len as u16)?;
        let index = u16::from(fmmu == FMMU_READS);
        bus.write(to, reg::FMMU + index * reg::FMMU_LEN, &fmmu_of(at, len, manager.start, fmmu))?;
    }
    let begins_ns = clocks.map(|clocks| clocks::start_sync0(bus, subdevice, clocks.sync0)).transpose()?;
    subdevice.change(bus, State::SafeOp)?;
    Ok(begins_ns)
}

fn set_sync_manager(bus: &mut Bus, station: u16, number: u16, manager: &SyncManager, len: u16) -> Result<(), String> {
    let ([start, start_high], [low, high]) = (manager.start.to_le_bytes(), len.to_le_bytes());
    bus.write(station, reg::SYNC_MANAGER + number * reg::SYNC_MANAGER_LEN, &[start, start_high, low, high, manager.control, 0, 1, 0])
}

/// Whole bytes, at this logical address.
fn fmmu_of(logical: usize, len: usize, physical: u16, kind: u8) -> [u8; 16] {
    let mut fmmu = [0; 16];
    fmmu[..4].copy_from_slice(&(logical as u32).to_le_bytes());
    fmmu[4..6].copy_from_slice(&(len as u16).to_le_bytes());
    fmmu[7] = 7;
    fmmu[8..10].copy_from_slice(&physical.to_le_bytes());
    (fmmu[11], fmmu[12]) = (kind, 1);
    fmmu
}
