// SPDX-License-Identifier: Apache-2.0
//! What a drive is told before it exchanges process data.
use super::axis::Axis;
use crate::client::{Client, Refused};
use crate::nmt::Command;
use crate::pdo::{self, Pdo};
use cia402::{Entry, Mode};

/// Bits of a PDO's identifier: it is not used; nobody may ask for it.
const UNUSED: u32 = 0x8000_0000;
const NOT_ASKED_FOR: u32 = 0x4000_0000;
/// Transmission with each SYNC.
const EACH_SYNC: u8 = 1;
/// What a drive does without its controller (0x6007): a quick stop.
const QUICK_STOP: i16 = 3;
/// Profile of drives, in the lower half of a node's type.
const DRIVES: u32 = 402;

/// What all drives of a bus are told.
pub struct Terms {
    pub own_node: u8,
    pub timeout_ns: i64,
    pub heartbeat_ns: i64,
    pub cycle_ns: i64,
}

struct Told<'a> {
    client: &'a mut Client,
    node: u8,
    name: String,
}

/// Configures the drive of an axis: it is pre-operational then, and moves nothing.
///
/// # Errors
/// For people: the drive does not answer, is none, or lacks what is needed.
pub fn configure(client: &mut Client, axis: &mut Axis, terms: &Terms) -> Result<(), String> {
    let (node, name) = (axis.node, axis.name.clone());
    client.send(&Command::PreOperational.frame(node)).map_err(|error| error.to_string())?;
    let mut told = Told { client, node, name };
    told.recognise(axis.scale.mode)?;
    told.watch(terms, axis.is_watched)?;
    told.write(0x6060, 0, &[axis.scale.mode as u8])?;
    told.pace(terms)?;
    let mut outputs = pdo::outputs(axis.scale.mode);
    told.map(0x1400, 0x1600, 0x200 + u32::from(node), &mut outputs)?;
    let [first, second] = &mut axis.inputs;
    told.map(0x1800, 0x1A00, 0x180 + u32::from(node), first)?;
    told.map(0x1801, 0x1A01, 0x280 + u32::from(node), second)?;
    for unused in [0x1401, 0x1402, 0x1403, 0x1802, 0x1803] {
        told.drop_pdo(unused)?;
    }
    Ok(())
}

impl Told<'_> {
    fn wrong(&self, index: u16, sub: u8, why: &Refused) -> String {
        let (node, name) = (self.node, &self.name);
        match why {
            Refused::Silent => {
                format!("node {node} (axis '{name}') does not answer; look at its power, its number, the bit rate and the terminating resistors")
            }
            Refused::Link(error) => format!("node {node} (axis '{name}') is not reached: {error}; is the interface up?"),
            _ => format!("node {node} (axis '{name}') object {index:#06x}:{sub}: it {why}"),
        }
    }

    fn read(&mut self, index: u16, sub: u8) -> Result<u32, String> {
        let value = self.client.upload(self.node, Entry { index, sub }).map_err(|why| self.wrong(index, sub, &why))?;
        Ok(value.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte)))
    }

    fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), String> {
        self.client.download(self.node, Entry { index, sub }, value).map_err(|why| self.wrong(index, sub, &why))
    }

    /// The same, of an object that a drive may lack, or have otherwise; false: it refuses.
    fn try_write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<bool, String> {
        match self.client.download(self.node, Entry { index, sub }, value) {
            Ok(()) => Ok(true),
            Err(Refused::Aborted(_)) => Ok(false),
            Err(why) => Err(self.wrong(index, sub, &why)),
        }
    }

    fn recognise(&mut self, mode: Mode) -> Result<(), String> {
        let (node, name) = (self.node, self.name.clone());
        let kind = self.read(0x1000, 0)?;
        if kind & 0xFFFF != DRIVES {
            return Err(format!("node {node} (axis '{name}') is no drive by CiA 402: it is of profile {}", kind & 0xFFFF));
        }
        // Which modes it has: a bit each, where it says so.
        let bit = mode as u32 - 1;
        match self.client.upload(node, Entry { index: 0x6502, sub: 0 }) {
            Ok(modes) if modes.len() == 4 && u32::from_le_bytes([modes[0], modes[1], modes[2], modes[3]]) >> bit & 1 == 0 => {
                Err(format!("node {node} (axis '{name}') has no mode {} (cyclic synchronous {mode:?}); object 0x6502 says which it has", mode as u8))
            }
            Ok(_) | Err(Refused::Aborted(_)) => Ok(()),
            Err(why) => Err(self.wrong(0x6502, 0, &why)),
        }
    }

    /// The drive says that it is there, and watches whether this controller is.
    fn watch(&mut self, terms: &Terms, is_watched: bool) -> Result<(), String> {
        let ms = |ns: i64| (ns / 1_000_000) as u16;
        self.write(0x1017, 0, &ms(terms.heartbeat_ns).to_le_bytes())?;
        let consumed = if is_watched { u32::from(terms.own_node) << 16 | u32::from(ms(terms.timeout_ns)) } else { 0 };
        let has_watchdog = self.try_write(0x1016, 1, &consumed.to_le_bytes())?;
        if is_watched && !has_watchdog {
            return Err(format!(
                "node {} (axis '{}') cannot watch for this controller: it refuses object 0x1016:1; with \"watchdog\": false it is used without",
                self.node, self.name
            ));
        }
        self.try_write(0x6007, 0, &QUICK_STOP.to_le_bytes()).map(drop)
    }

    /// How long a cycle is, where the drive wants to know it.
    fn pace(&mut self, terms: &Terms) -> Result<(), String> {
        let micros = (terms.cycle_ns / 1000) as u32;
        self.try_write(0x1006, 0, &micros.to_le_bytes())?;
        // A mantissa of one byte, and a power of ten of seconds.
        let (mut mantissa, mut power) = (micros, -6i8);
        while mantissa > 255 || mantissa.is_multiple_of(10) {
            (mantissa, power) = (mantissa / 10, power + 1);
        }
        self.try_write(0x60C2, 1, &[mantissa as u8])?;
        self.try_write(0x60C2, 2, &power.to_le_bytes()).map(drop)
    }

    /// Maps objects into a PDO that goes with each SYNC; one that the drive may lack, and does not map, is left out.
    fn map(&mut self, index: u16, mapping: u16, id: u32, wanted: &mut Pdo) -> Result<(), String> {
        let before = self.read(index, 1)?;
        self.write(index, 1, &(before | UNUSED).to_le_bytes())?;
        self.write(mapping, 0, &[0])?;
        let mut mapped = Pdo::default();
        for word in std::mem::take(&mut wanted.words) {
            let sub = mapped.words.len() as u8 + 1;
            if !pdo::is_optional(word) {
                self.write(mapping, sub, &word.to_le_bytes())?;
            } else if !self.try_write(mapping, sub, &word.to_le_bytes())? {
                continue;
            }
            mapped.words.push(word);
        }
        *wanted = mapped;
        if wanted.is_empty() {
            return Ok(());
        }
        self.write(mapping, 0, &[wanted.words.len() as u8])?;
        self.write(index, 2, &[EACH_SYNC])?;
        self.write(index, 1, &(id | before & NOT_ASKED_FOR).to_le_bytes())
    }

    /// Uses a PDO no more, where the drive has it.
    fn drop_pdo(&mut self, index: u16) -> Result<(), String> {
        match self.client.upload(self.node, Entry { index, sub: 1 }) {
            Ok(id) if id.len() == 4 => {
                let id = u32::from_le_bytes([id[0], id[1], id[2], id[3]]) | UNUSED;
                self.try_write(index, 1, &id.to_le_bytes()).map(drop)
            }
            Ok(_) | Err(Refused::Aborted(_)) => Ok(()),
            Err(why) => Err(self.wrong(index, 1, &why)),
        }
    }
}
