// SPDX-License-Identifier: Apache-2.0
//! Configures a node before it exchanges process data.
use super::options::PdosFrom;
use super::station::{Station, What};
use crate::client::{Client, SdoError};
use crate::nmt::Command;
use crate::pdo::{self, LEN_MAX, PDOS, Pdo};
use cia402::identity::Identity;
use cia402::{Entry, Mode};

/// Bits of a PDO's COB-ID: PDO is not used; remote requests are not allowed.
const UNUSED: u32 = 0x8000_0000;
const NOT_ASKED_FOR: u32 = 0x4000_0000;
/// Transmission type: with every SYNC.
const EACH_SYNC: u8 = 1;
/// Reaction of a drive to the loss of its controller (0x6007): quick stop.
const QUICK_STOP: i16 = 3;
/// Reaction of a module to the loss of its controller (0x1029): it stops, and its outputs take their error values.
const STOPS: u8 = 2;
/// Device profile numbers, in the lower half of a node's device type.
const DRIVES: u32 = 402;
const MODULES: u32 = 401;

/// Settings common to all nodes of a bus.
pub struct Terms {
    pub own_node: u8,
    pub timeout_ns: i64,
    pub heartbeat_ns: i64,
    pub cycle_ns: i64,
}

/// Objects of the PDOs in one direction: their communication parameters, their mappings, and the identifier of the first PDO.
#[derive(Clone, Copy)]
struct Way {
    parameters: u16,
    mappings: u16,
    identifier: u16,
}

const RECEIVED: Way = Way { parameters: 0x1400, mappings: 0x1600, identifier: 0x200 };
const SENT: Way = Way { parameters: 0x1800, mappings: 0x1A00, identifier: 0x180 };

struct NodeSetup<'a> {
    client: &'a mut Client,
    node: u8,
    title: String,
    mapping: PdosFrom,
}

/// Reads the identity of a node (object 0x1018); numbers that it does not provide are 0. Afterwards the node is pre-operational.
///
/// # Errors
/// Fails with a message if the node does not answer.
pub fn identify(client: &mut Client, station: &Station) -> Result<Identity, String> {
    client.send(&Command::PreOperational.frame(station.node)).map_err(|error| error.to_string())?;
    let mut told = NodeSetup { client, node: station.node, title: station.title(), mapping: station.mapping };
    let mut number = |sub| Ok::<u32, String>(told.try_read(0x1018, sub)?.unwrap_or(0));
    Ok(Identity { vendor: number(1)?, product: number(2)?, revision: number(3)?, serial: number(4)?, alias: 0 })
}

/// Configures a node. During configuration, the node is pre-operational and does not move anything.
///
/// # Errors
/// Fails with a message if the node does not answer, has a different profile than expected, or lacks a required object.
pub fn configure(client: &mut Client, station: &mut Station, terms: &Terms) -> Result<(), String> {
    client.send(&Command::PreOperational.frame(station.node)).map_err(|error| error.to_string())?;
    let mut told = NodeSetup { client, node: station.node, title: station.title(), mapping: station.mapping };
    told.recognise(station)?;
    told.watch(terms, station.is_watched)?;
    match &station.what {
        What::Axis(axis) => {
            told.try_write(0x6007, 0, &QUICK_STOP.to_le_bytes())?;
            for (of, value) in axis.settings() {
                told.try_write(of.index, of.sub, &value)?;
            }
            told.write(0x6060, 0, &[axis.mode as u8])?;
            told.pace(terms)?;
        }
        What::Module(module) => {
            told.count(module.groups())?;
            told.try_write(0x1029, 1, &[STOPS])?;
            for (of, value) in module.settings() {
                let is_taken = told.try_write(of.index, of.sub, &value)?;
                if let (false, Some(short)) = (is_taken, shortened(&value)) {
                    told.try_write(of.index, of.sub, &short)?;
                }
            }
        }
    }
    leave_out(station)?;
    let is_needed = |word| station.needs(word);
    let (mut inputs, mut outputs) = (station.inputs.clone(), station.outputs.clone());
    for number in 0..PDOS {
        told.map(RECEIVED, number as u16, &mut outputs[number], is_needed)?;
        told.map(SENT, number as u16, &mut inputs[number], is_needed)?;
    }
    (station.inputs, station.outputs) = (inputs, outputs);
    match station.mode() {
        Some(mode) => told.check_mapped(mode, station),
        None => Ok(()),
    }
}

/// Converts an error value from 32 bits to the 16 bits used by some modules; returns `None` if it has the wrong length or does not fit
/// into 16 bits.
fn shortened(value: &[u8]) -> Option<[u8; 2]> {
    let whole = i32::from_le_bytes(value.try_into().ok()?);
    Some(i16::try_from(whole).ok()?.to_le_bytes())
}

/// Removes objects that cannot be mapped according to the node's EDS file.
fn leave_out(station: &mut Station) -> Result<(), String> {
    let Some(eds) = station.eds.clone() else { return Ok(()) };
    let cannot = |word: &pdo::Word| eds.object(pdo::entry(*word)).is_none_or(|object| !object.is_mappable);
    let words = || station.inputs.iter().chain(&station.outputs).flat_map(|pdo| pdo.words.iter().copied());
    if let Some(word) = words().find(|word| station.needs(*word) && cannot(word)) {
        return Err(format!("{}: its EDS file has no object {:#06x}:{} that can be mapped", station.title(), word >> 16, word >> 8 & 0xFF));
    }
    station.inputs.iter_mut().chain(&mut station.outputs).for_each(|pdo| pdo.words.retain(|word| !cannot(word)));
    Ok(())
}

impl NodeSetup<'_> {
    fn wrong(&self, index: u16, sub: u8, why: &SdoError) -> String {
        let title = &self.title;
        match why {
            SdoError::Silent => format!("{title} does not answer; check its power, its number, the bit rate and the terminating resistors"),
            SdoError::Link(error) => format!("{title} cannot be reached: {error}; check that the interface is up"),
            _ => format!("{title} object {index:#06x}:{sub}: {why}"),
        }
    }

    fn read(&mut self, index: u16, sub: u8) -> Result<u32, String> {
        let value = self.client.upload(self.node, Entry { index, sub }).map_err(|why| self.wrong(index, sub, &why))?;
        Ok(number(&value))
    }

    /// Reads an optional object dictionary entry of a node.
    fn try_read(&mut self, index: u16, sub: u8) -> Result<Option<u32>, String> {
        match self.client.upload(self.node, Entry { index, sub }) {
            Ok(value) => Ok(Some(number(&value))),
            Err(SdoError::Aborted(_)) => Ok(None),
            Err(why) => Err(self.wrong(index, sub, &why)),
        }
    }

    fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), String> {
        self.client.download(self.node, Entry { index, sub }, value).map_err(|why| self.wrong(index, sub, &why))
    }

    /// Writes an object dictionary entry that a node may lack or implement differently; returns false if the node aborts the transfer.
    fn try_write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<bool, String> {
        match self.client.download(self.node, Entry { index, sub }, value) {
            Ok(()) => Ok(true),
            Err(SdoError::Aborted(_)) => Ok(false),
            Err(why) => Err(self.wrong(index, sub, &why)),
        }
    }

    /// Checks that the node matches its configuration: profile, mode, and the product in its data sheet.
    fn recognise(&mut self, station: &Station) -> Result<(), String> {
        let title = self.title.clone();
        let profile = self.read(0x1000, 0)? & 0xFFFF;
        let (wanted, kind) = if station.mode().is_some() { (DRIVES, "CiA 402 drive") } else { (MODULES, "CiA 401 module") };
        if profile != wanted {
            return Err(format!("{title} is not a {kind}: its profile is {profile}"));
        }
        if let Some(eds) = &station.eds {
            for (sub, what, expected) in [(1, "vendor", eds.vendor), (2, "product", eds.product)] {
                let is = self.try_read(0x1018, sub)?;
                if let (Some(expected), Some(is)) = (expected, is)
                    && expected != is
                {
                    return Err(format!("{title} does not match its EDS file: its {what} is {is:#010x}, but that of the file is {expected:#010x}"));
                }
            }
        }
        // The node may state its supported modes, one bit each.
        let Some(mode) = station.mode() else { return Ok(()) };
        match self.try_read(0x6502, 0)? {
            Some(modes) if modes >> (mode as u32 - 1) & 1 == 0 => {
                Err(format!("{title} has no mode {} (cyclic synchronous {mode:?}); read object 0x6502 for the modes that it supports", mode as u8))
            }
            _ => Ok(()),
        }
    }

    /// Checks that the node has the terminals that its channels need. Each group consists of the object, the number of subindices needed,
    /// and their kind.
    fn count(&mut self, groups: impl Iterator<Item = (u16, u8, &'static str)>) -> Result<(), String> {
        for (index, needed, what) in groups {
            let has = self.try_read(index, 0)?.unwrap_or(0);
            if has < needed.into() {
                return Err(format!("{} has {has} {what} (object {index:#06x}:0), but a channel needs number {needed}", self.title));
            }
        }
        Ok(())
    }

    /// Makes the node send its heartbeat and monitor the heartbeat of this controller.
    fn watch(&mut self, terms: &Terms, is_watched: bool) -> Result<(), String> {
        let ms = |ns: i64| (ns / 1_000_000) as u16;
        self.write(0x1017, 0, &ms(terms.heartbeat_ns).to_le_bytes())?;
        let consumed = if is_watched { u32::from(terms.own_node) << 16 | u32::from(ms(terms.timeout_ns)) } else { 0 };
        let has_watchdog = self.try_write(0x1016, 1, &consumed.to_le_bytes())?;
        if is_watched && !has_watchdog {
            return Err(format!("{} cannot monitor this controller: it refuses object 0x1016:1; set \"watchdog\": false to use it without", self.title));
        }
        Ok(())
    }

    /// Sets the cycle time in the drive, if the drive accepts it.
    fn pace(&mut self, terms: &Terms) -> Result<(), String> {
        let micros = (terms.cycle_ns / 1000) as u32;
        self.try_write(0x1006, 0, &micros.to_le_bytes())?;
        // The encoding is a mantissa of one byte, and a power of ten of seconds.
        let (mut mantissa, mut power) = (micros, -6i8);
        while mantissa > 255 || mantissa.is_multiple_of(10) {
            (mantissa, power) = (mantissa / 10, power + 1);
        }
        self.try_write(0x60C2, 1, &[mantissa as u8])?;
        self.try_write(0x60C2, 2, &power.to_le_bytes()).map(drop)
    }

    /// Maps these objects to a PDO that is exchanged with every SYNC. An optional object that the node cannot map is omitted; a PDO
    /// without objects is disabled.
    fn map(&mut self, way: Way, number: u16, wanted: &mut Pdo, is_needed: impl Fn(pdo::Word) -> bool) -> Result<(), String> {
        let (index, mapping) = (way.parameters + number, way.mappings + number);
        if self.mapping == PdosFrom::Device {
            *wanted = self.mapped(index, mapping)?;
        }
        if wanted.is_empty() {
            return self.drop_pdo(index);
        }
        let before = self.read(index, 1)?;
        self.write(index, 1, &(before | UNUSED).to_le_bytes())?;
        if self.mapping == PdosFrom::Written {
            self.write_mapping(mapping, wanted, is_needed)?;
        }
        if wanted.is_empty() {
            return Ok(());
        }
        self.write(index, 2, &[EACH_SYNC])?;
        let id = u32::from(way.identifier + 0x100 * number) + u32::from(self.node);
        self.write(index, 1, &(id | before & NOT_ASKED_FOR).to_le_bytes())
    }

    fn write_mapping(&mut self, mapping: u16, wanted: &mut Pdo, is_needed: impl Fn(pdo::Word) -> bool) -> Result<(), String> {
        self.write(mapping, 0, &[0])?;
        let mut mapped = Pdo::default();
        for word in std::mem::take(&mut wanted.words) {
            let sub = mapped.words.len() as u8 + 1;
            if is_needed(word) {
                self.write(mapping, sub, &word.to_le_bytes())?;
            } else if !self.try_write(mapping, sub, &word.to_le_bytes())? {
                continue;
            }
            mapped.words.push(word);
        }
        *wanted = mapped;
        if wanted.is_empty() { Ok(()) } else { self.write(mapping, 0, &[wanted.words.len() as u8]) }
    }

    /// Returns the current mapping of a PDO of the node; `None` if the PDO is not used, or contains objects that are not a whole number
    /// of bytes.
    fn mapped(&mut self, index: u16, mapping: u16) -> Result<Pdo, String> {
        let is_used = self.try_read(index, 1)?.is_some_and(|id| id & UNUSED == 0);
        let count = if is_used { self.try_read(mapping, 0)?.unwrap_or(0) } else { 0 };
        let words: Vec<u32> = (1..=count.min(64) as u8).map(|sub| self.read(mapping, sub)).collect::<Result<_, _>>()?;
        let (is_whole, pdo) = (words.iter().all(|word| (word & 0xFF).is_multiple_of(8)), Pdo { words });
        Ok(if is_whole && pdo.len() <= LEN_MAX { pdo } else { Pdo::default() })
    }

    /// Checks that a drive that keeps its own mapping exchanges all objects that an axis needs.
    fn check_mapped(&self, mode: Mode, station: &Station) -> Result<(), String> {
        let has = |pdos: &pdo::Pdos, word| pdos.iter().any(|pdo| pdo.at(word).is_some());
        let outputs = [pdo::CONTROL, pdo::target(mode)].into_iter().find(|word| !has(&station.outputs, *word));
        let inputs = [pdo::STATUS, pdo::POSITION].into_iter().find(|word| !has(&station.inputs, *word));
        match outputs.or(inputs) {
            Some(word) => Err(format!("{} does not exchange object {:#06x}; let the driver write the PDOs: \"pdos\": \"written\"", self.title, word >> 16)),
            None => Ok(()),
        }
    }

    /// Disables a PDO, if the node has it.
    fn drop_pdo(&mut self, index: u16) -> Result<(), String> {
        match self.try_read(index, 1)? {
            Some(id) => self.try_write(index, 1, &(id | UNUSED).to_le_bytes()).map(drop),
            None => Ok(()),
        }
    }
}

/// Returns a value of up to 4 bytes as an unsigned number.
fn number(value: &[u8]) -> u32 {
    value.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}
