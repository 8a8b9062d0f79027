// SPDX-License-Identifier: Apache-2.0
//! Brings subdevices from any state to SAFEOP, with their process data mapped to the addresses that the cycle uses.
use super::bus::Bus;
use super::clocks::{self, Clocks, Reference};
use super::mapping::{self, Mapping, Window};
use super::subdevices::Subdevice;
use crate::coe::Entry;
use crate::registers as reg;
use crate::sii::SyncManager;
use crate::states::State;

/// Watchdog time unit, ns, for divider 2498 and a 25 MHz clock.
const WATCHDOG_UNIT_NS: i64 = 100_000;
const WATCHDOG_DIVIDER: u16 = 2498;
const FMMU_READS: u8 = 1;
const FMMU_WRITES: u8 = 2;

/// Objects that a subdevice exchanges.
#[derive(Clone, Debug)]
pub enum Pdos {
    /// The subdevice keeps its current objects.
    Device,
    /// Objects to map, for outputs and inputs: index, subindex and length in bits of each, packed into one number.
    Written(Vec<u32>, Vec<u32>),
    /// Objects that the terminal describes; if it has no objects, the entries listed in its EEPROM.
    Terminal,
}

/// A subdevice that exchanges process data, with the position of its data among those of all subdevices.
#[derive(Clone, Debug)]
pub struct Station {
    pub subdevice: Subdevice,
    pub mapping: Mapping,
    /// Offset from the start of the process data of all subdevices, bytes.
    pub outputs_at: usize,
    pub inputs_at: usize,
    pub is_synced: bool,
}

/// Requested settings of a subdevice.
pub struct SubdeviceSettings<'a> {
    pub position: usize,
    pub pdos: &'a Pdos,
    /// Objects to write in PREOP, each with its entry, its value, and whether it is skipped if missing.
    pub settings: &'a [(Entry, Vec<u8>, bool)],
    /// True if the subdevice applies its outputs at SYNC0, provided that clocks are used.
    pub is_synced: bool,
}

/// A line that was brought up: the subdevices in the requested order, and the total number of output bytes and of input bytes.
pub struct Line {
    pub stations: Vec<Station>,
    pub outputs: usize,
    pub inputs: usize,
    pub reference: Option<Reference>,
    /// System time at which SYNC0 starts in all subdevices.
    pub synced_from_ns: Option<u64>,
}

/// Brings the requested subdevices to SAFEOP, with their clocks and SYNC0 if `clocks` is passed. The line must already have been taken
/// over.
///
/// # Errors
/// Fails with a message that names the subdevice.
pub fn bring_up(bus: &mut Bus, found: &[Subdevice], wanted: &[SubdeviceSettings<'_>], watchdog_ns: i64, clocks: Option<&Clocks<'_>>) -> Result<Line, String> {
    let reference = clocks.map(|clocks| clocks::synchronise(bus, found, clocks)).transpose()?;
    let mut stations = Vec::with_capacity(wanted.len());
    for want in wanted {
        let missing = || format!("there is no subdevice {}: {} answer; check the cables and the power after the last of them", want.position, found.len());
        let subdevice = found.get(want.position).ok_or_else(missing)?;
        let mapping = to_pre_op(bus, subdevice, want).map_err(|error| named(subdevice, &error))?;
        stations.push(Station { subdevice: subdevice.clone(), mapping, outputs_at: 0, inputs_at: 0, is_synced: want.is_synced });
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
        let clocks = clocks.filter(|_| station.is_synced);
        let begins_ns = to_safe_op(bus, station, watchdog_ns, clocks).map_err(|error| named(&station.subdevice, &error))?;
        synced_from_ns = synced_from_ns.max(begins_ns);
    }
    Ok(Line { stations, outputs, inputs: end - outputs, reference, synced_from_ns })
}

fn named(subdevice: &Subdevice, error: &str) -> String {
    if error.starts_with("subdevice") { error.to_owned() } else { format!("{}: {error}", subdevice.title()) }
}

fn to_pre_op(bus: &mut Bus, subdevice: &Subdevice, want: &SubdeviceSettings<'_>) -> Result<Mapping, String> {
    if matches!(want.pdos, Pdos::Terminal) {
        return terminal_to_pre_op(bus, subdevice);
    }
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
    mapping::read(bus, subdevice, &mut mailbox)
}

/// Brings a terminal to PREOP. It exchanges the data described by its objects or, if it has none, by its EEPROM.
fn terminal_to_pre_op(bus: &mut Bus, subdevice: &Subdevice) -> Result<Mapping, String> {
    let contents = &subdevice.contents;
    for (number, manager) in (0..).zip(&contents.sync_managers).filter(|(_, manager)| matches!(manager.kind, 1 | 2)) {
        set_sync_manager(bus, subdevice.station, number, manager, manager.len)?;
    }
    subdevice.change(bus, State::PreOp)?;
    let by_eeprom = mapping::of_eeprom(contents);
    match subdevice.mailbox() {
        Ok(mut mailbox) => match mapping::read(bus, subdevice, &mut mailbox) {
            // Some terminals have objects, but none that describes the process data.
            Ok(Mapping { windows, .. }) if windows.is_empty() => Ok(by_eeprom),
            Err(_) if !by_eeprom.windows.is_empty() => Ok(by_eeprom),
            by_objects => by_objects,
        },
        Err(_) => Ok(by_eeprom),
    }
}

fn to_safe_op(bus: &mut Bus, station: &Station, watchdog_ns: i64, clocks: Option<&Clocks<'_>>) -> Result<Option<u64>, String> {
    let subdevice = &station.subdevice;
    let to = subdevice.station;
    // The value 0 disables it.
    let units = if watchdog_ns == 0 { 0 } else { (watchdog_ns / WATCHDOG_UNIT_NS).clamp(1, u16::MAX.into()) as u16 };
    bus.write(to, reg::WATCHDOG_DIVIDER, &WATCHDOG_DIVIDER.to_le_bytes())?;
    bus.write(to, reg::WATCHDOG_OUTPUTS, &units.to_le_bytes())?;
    for window in &station.mapping.windows {
        // The watchdog of outputs is enabled, whatever the EEPROM contains.
        let control = if window.is_output { window.manager.control | 0x40 } else { window.manager.control };
        set_sync_manager(bus, to, window.number, &SyncManager { control, ..window.manager }, window.len as u16)?;
    }
    for (index, span) in (0..).zip(joined(&station.mapping.windows)) {
        let (kind, start) = if span.is_output { (FMMU_WRITES, station.outputs_at) } else { (FMMU_READS, station.inputs_at) };
        bus.write(to, reg::FMMU + index * reg::FMMU_LEN, &fmmu_of(start + span.at, span.len, span.manager.start, kind))?;
    }
    let begins_ns = clocks.map(|clocks| clocks::start_sync0(bus, subdevice, clocks.sync0)).transpose()?;
    subdevice.change(bus, State::SafeOp)?;
    Ok(begins_ns)
}

/// Merges windows that are adjacent in the subdevice's memory into one, because the subdevice may have only a single FMMU for them.
fn joined(windows: &[Window]) -> Vec<Window> {
    let mut spans: Vec<Window> = Vec::new();
    for window in windows {
        match spans.last_mut() {
            Some(span) if span.is_output == window.is_output && usize::from(span.manager.start) + span.len == usize::from(window.manager.start) => {
                span.len += window.len;
            }
            _ => spans.push(*window),
        }
    }
    spans
}

fn set_sync_manager(bus: &mut Bus, station: u16, number: u16, manager: &SyncManager, len: u16) -> Result<(), String> {
    let ([start, start_high], [low, high]) = (manager.start.to_le_bytes(), len.to_le_bytes());
    bus.write(station, reg::SYNC_MANAGER + number * reg::SYNC_MANAGER_LEN, &[start, start_high, low, high, manager.control, 0, 1, 0])
}

/// Returns an FMMU that maps whole bytes at this logical address.
fn fmmu_of(logical: usize, len: usize, physical: u16, kind: u8) -> [u8; 16] {
    let mut fmmu = [0; 16];
    fmmu[..4].copy_from_slice(&(logical as u32).to_le_bytes());
    fmmu[4..6].copy_from_slice(&(len as u16).to_le_bytes());
    fmmu[7] = 7;
    fmmu[8..10].copy_from_slice(&physical.to_le_bytes());
    (fmmu[11], fmmu[12]) = (kind, 1);
    fmmu
}
