// SPDX-License-Identifier: Apache-2.0
//! Memory of a subdevice controller: registers, SyncManagers, FMMUs, EEPROM interface, clock.
use super::clock::Clock;
use crate::frames::{put, u16_at, u32_at};
use crate::registers as reg;

/// Size of the registers and process memory.
const MEMORY_LEN: usize = 0x3000;
const FMMUS: usize = 8;
const SYNC_MANAGERS: usize = 8;
/// Status bits of the EEPROM interface: 8 bytes are read at a time; an error has occurred.
const EEPROM_EIGHT: u16 = 0x0040;
const EEPROM_READ: u16 = 0x0100;
const EEPROM_RELOAD: u16 = 0x0400;
const EEPROM_COMMANDS: u16 = 0x0700;
const EEPROM_ERROR: u16 = 0x2000;

/// Memory of a subdevice controller, and the units that the memory controls.
pub struct Controller {
    memory: Box<[u8]>,
    eeprom: Vec<u8>,
    wiring: Wiring,
    pub clock: Clock,
    /// Time that a frame takes from port 1 through all subsequent subdevices and back, ns; `None` if there are no such subdevices.
    behind_ns: Option<u64>,
}

/// SyncManagers and their purposes.
#[derive(Clone, Debug, Default)]
pub struct Wiring {
    /// True if the first two SyncManagers are a mailbox.
    pub has_mailbox: bool,
    /// Numbers of the output SyncManagers, and numbers of the input SyncManagers.
    pub outputs: Vec<usize>,
    pub inputs: Vec<usize>,
}

/// Effects of a write that the subdevice has to handle.
#[derive(Clone, Copy, Debug, Default)]
pub struct WriteEffects {
    pub al_control: bool,
    /// True if a message was written to the mailbox.
    pub mailbox: bool,
    /// True if the answer was not received and must be repeated.
    pub repeat: bool,
    /// True if outputs were written.
    pub outputs: bool,
}

impl Controller {
    pub fn new(eeprom: Vec<u8>, wiring: Wiring, clock: Clock) -> Controller {
        let mut memory = vec![0; MEMORY_LEN].into_boxed_slice();
        // The values are type, revision, build; 8 FMMUs, 8 SyncManagers, 8 KB, two Ethernet ports; 64-bit distributed clocks.
        put(&mut memory, reg::INFORMATION.into(), &[0x11, 0, 1, 0, FMMUS as u8, SYNC_MANAGERS as u8, 8, 0x0F]);
        put(&mut memory, reg::FEATURES.into(), &0x000Cu16.to_le_bytes());
        put(&mut memory, reg::AL_STATUS.into(), &1u16.to_le_bytes());
        put(&mut memory, reg::WATCHDOG_DIVIDER.into(), &2498u16.to_le_bytes());
        put(&mut memory, reg::WATCHDOG_OUTPUTS.into(), &1000u16.to_le_bytes());
        put(&mut memory, reg::WATCHDOG_STATUS.into(), &1u16.to_le_bytes());
        put(&mut memory, reg::EEPROM.into(), &EEPROM_EIGHT.to_le_bytes());
        put(&mut memory, reg::DC_SPEED.into(), &0x1000u16.to_le_bytes());
        Controller { memory, eeprom, wiring, clock, behind_ns: None }
    }

    pub fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    pub fn word(&self, address: u16) -> u16 {
        u16_at(&self.memory, address.into())
    }

    pub fn set_word(&mut self, address: u16, value: u16) {
        put(&mut self.memory, address.into(), &value.to_le_bytes());
    }

    /// Returns the process memory covered by a SyncManager.
    pub fn buffer(&self, manager: usize) -> &[u8] {
        let (start, len) = self.area(manager);
        self.memory.get(start..start + len).unwrap_or_default()
    }

    pub fn buffer_mut(&mut self, manager: usize) -> &mut [u8] {
        let (start, len) = self.area(manager);
        self.memory.get_mut(start..start + len).unwrap_or_default()
    }

    /// Returns the start and length of a SyncManager's memory.
    pub fn area(&self, manager: usize) -> (usize, usize) {
        let at = sync_manager(manager);
        (u16_at(&self.memory, at).into(), u16_at(&self.memory, at + 2).into())
    }

    pub fn is_active(&self, manager: usize) -> bool {
        self.memory[sync_manager(manager) + 6] & 1 != 0
    }

    /// Returns true if a SyncManager's control enables its watchdog.
    pub fn is_watched(&self, manager: usize) -> bool {
        self.memory[sync_manager(manager) + 4] & 0x40 != 0
    }

    /// Returns the maximum time between outputs, ns; 0 for no limit.
    pub fn watchdog_ns(&self) -> u64 {
        (u64::from(self.word(reg::WATCHDOG_DIVIDER)) + 2) * 40 * u64::from(self.word(reg::WATCHDOG_OUTPUTS))
    }

    pub fn is_full(&self, manager: usize) -> bool {
        self.memory[sync_manager(manager) + 5] & reg::MAILBOX_FULL != 0
    }

    pub fn set_full(&mut self, manager: usize, is_full: bool) {
        let status = &mut self.memory[sync_manager(manager) + 5];
        *status = if is_full { *status | reg::MAILBOX_FULL } else { *status & !reg::MAILBOX_FULL };
    }

    /// Acknowledges a repeated answer.
    pub fn acknowledge_repeat(&mut self) {
        let at = sync_manager(1);
        self.memory[at + 7] = self.memory[at + 7] & !2 | self.memory[at + 6] & 2;
    }

    /// Advances the clock. A frame arrives at this time, and returns to port 1 after `behind_ns`.
    pub fn tell_time(&mut self, now_ns: u64, behind_ns: Option<u64>) {
        self.behind_ns = behind_ns;
        self.clock.go_on(now_ns);
        let system_ns = self.system_ns();
        put(&mut self.memory, reg::DC_SYSTEM_TIME.into(), &system_ns.to_le_bytes());
    }

    /// Returns the system time of this clock.
    pub fn system_ns(&self) -> u64 {
        self.clock.local_ns().wrapping_add(u64::from_le_bytes(self.eight(reg::DC_OFFSET)))
    }

    /// Processes a comparison with the reference clock's time, of which 4 or all 8 bytes were written.
    fn compare(&mut self, written: &[u8]) {
        let Some(reference) = written.first_chunk().map(|low| u32::from_le_bytes(*low)) else { return };
        let expected = reference.wrapping_add(u32_at(&self.memory, reg::DC_DELAY.into()));
        self.clock.compare((self.system_ns() as u32).wrapping_sub(expected) as i32);
        put(&mut self.memory, reg::DC_DIFFERENCE.into(), &self.clock.difference().to_le_bytes());
    }

    /// Latches the times at which a frame arrived at the ports and at the processing unit.
    fn latch_times(&mut self) {
        let local_ns = self.clock.local_ns();
        put(&mut self.memory, reg::DC_RECEIVED.into(), &(local_ns as u32).to_le_bytes());
        let back_ns = self.behind_ns.map_or(0, |behind_ns| local_ns.wrapping_add(behind_ns) as u32);
        put(&mut self.memory, usize::from(reg::DC_RECEIVED) + 4, &back_ns.to_le_bytes());
        put(&mut self.memory, reg::DC_RECEIVED_UNIT.into(), &local_ns.to_le_bytes());
    }

    fn activate(&mut self) {
        let is_on = self.memory[usize::from(reg::SYNC_ACTIVATION)] & reg::SYNC0_ON == reg::SYNC0_ON;
        let start = (u64::from_le_bytes(self.eight(reg::SYNC0_START)), u32_at(&self.memory, reg::SYNC0_CYCLE.into()));
        let system_ns = self.system_ns();
        self.clock.set_sync(is_on.then_some(start), system_ns);
    }

    /// Returns true if SYNC0 is enabled, even if no SYNC0 event occurs.
    pub fn is_synchronised(&self) -> bool {
        self.memory[usize::from(reg::SYNC_ACTIVATION)] & reg::SYNC0_ON == reg::SYNC0_ON
    }

    fn eight(&self, address: u16) -> [u8; 8] {
        let mut eight = [0; 8];
        eight.copy_from_slice(&self.memory[address.into()..usize::from(address) + 8]);
        eight
    }

    /// Reads memory; returns false if it cannot be read.
    pub fn read(&mut self, address: u16, into: &mut [u8], or: bool) -> bool {
        let start = usize::from(address);
        let end = start + into.len();
        if end > MEMORY_LEN || self.is_refused(start, true) {
            return false;
        }
        for (to, from) in into.iter_mut().zip(&self.memory[start..end]) {
            *to = if or { *to | from } else { *from };
        }
        self.was_read(start, end);
        true
    }

    fn was_read(&mut self, start: usize, end: usize) {
        let (mailbox, len) = self.area(1);
        let is_emptied = self.wiring.has_mailbox && start >= mailbox && end == mailbox + len && self.is_active(1);
        if is_emptied {
            self.set_full(1, false);
        }
    }

    /// Returns true if access to a mailbox is denied: an empty mailbox cannot be read, and a full one cannot be written.
    fn is_refused(&self, start: usize, is_read: bool) -> bool {
        let manager = usize::from(is_read);
        let (mailbox, len) = self.area(manager);
        let is_inside = self.wiring.has_mailbox && len > 0 && (mailbox..mailbox + len).contains(&start) && self.is_active(manager);
        is_inside && self.is_full(manager) != is_read
    }

    /// Writes memory; returns `None` if it cannot be written. Registers that only the subdevice may write do not change.
    pub fn write(&mut self, address: u16, from: &[u8]) -> Option<WriteEffects> {
        let start = usize::from(address);
        let end = start + from.len();
        if end > MEMORY_LEN || self.is_refused(start, false) {
            return None;
        }
        if start == usize::from(reg::DC_SYSTEM_TIME) {
            self.compare(from);
            return Some(WriteEffects::default());
        }
        for (to, value) in (start..end).zip(from) {
            if is_writable(to) {
                self.memory[to] = *value;
            }
        }
        Some(self.was_written(start, end))
    }

    fn was_written(&mut self, start: usize, end: usize) -> WriteEffects {
        let touches = |address: u16| start <= usize::from(address) && usize::from(address) < end;
        if touches(reg::EEPROM) || touches(reg::EEPROM + 1) {
            self.command_eeprom();
        }
        if touches(reg::DC_RECEIVED) {
            self.latch_times();
        }
        if touches(reg::SYNC_ACTIVATION) {
            self.activate();
        }
        let (mailbox, len) = self.area(0);
        let is_whole = |manager: &usize| {
            let (outputs, len) = self.area(*manager);
            len > 0 && start <= outputs && end >= outputs + len && self.is_active(*manager)
        };
        let outputs = self.wiring.outputs.iter().any(is_whole);
        let is_filled = self.wiring.has_mailbox && start >= mailbox && len > 0 && end == mailbox + len && self.is_active(0);
        if is_filled {
            self.set_full(0, true);
        }
        let answer = sync_manager(1);
        WriteEffects {
            al_control: touches(reg::AL_CONTROL),
            mailbox: is_filled,
            repeat: start <= answer + 6 && answer + 6 < end && (self.memory[answer + 6] ^ self.memory[answer + 7]) & 2 != 0,
            outputs,
        }
    }

    fn command_eeprom(&mut self) {
        let command = self.word(reg::EEPROM) & EEPROM_COMMANDS;
        let mut status = EEPROM_EIGHT;
        match command {
            0 => {}
            EEPROM_READ => {
                let from = 2 * u32_at(&self.memory, reg::EEPROM_ADDRESS.into()) as usize;
                for i in 0..8 {
                    self.memory[usize::from(reg::EEPROM_DATA) + i] = self.eeprom.get(from.saturating_add(i)).copied().unwrap_or(0xFF);
                }
            }
            EEPROM_RELOAD => {}
            // The content is read-only.
            _ => status |= EEPROM_ERROR,
        }
        self.set_word(reg::EEPROM, status);
    }

    /// Processes a logical datagram with the FMMUs. Returns the sum of 1 if data were read and 2 if data were written, and the effects of
    /// the write.
    pub fn logical(&mut self, start: u32, data: &mut [u8], reads: bool, writes: bool) -> (u16, WriteEffects) {
        let mut done = (false, false);
        let mut changed = WriteEffects::default();
        for fmmu in 0..FMMUS {
            let at = usize::from(reg::FMMU) + fmmu * usize::from(reg::FMMU_LEN);
            let (logical, len) = (u32_at(&self.memory, at), u32::from(u16_at(&self.memory, at + 4)));
            let (kind, is_active) = (self.memory[at + 11], self.memory[at + 12] & 1 != 0);
            let is_inside = is_active && len > 0 && logical >= start && u64::from(logical) + u64::from(len) <= u64::from(start) + data.len() as u64;
            if !is_inside {
                continue;
            }
            let physical = u16_at(&self.memory, at + 8);
            let of = &mut data[(logical - start) as usize..(logical - start + len) as usize];
            let is_bits = self.memory[at + 6] != 0 || self.memory[at + 7] != 7;
            if kind & 1 != 0 && reads {
                done.0 |= if is_bits { self.read_bits(at, physical, of) } else { self.read(physical, of, false) };
            } else if kind & 2 != 0
                && writes
                && !is_bits
                && let Some(now) = self.write(physical, of)
            {
                done.1 = true;
                changed.outputs |= now.outputs;
                changed.mailbox |= now.mailbox;
            }
        }
        (u16::from(done.0) | u16::from(done.1) << 1, changed)
    }

    /// Reads some bits of one byte. Main devices use this to poll the mailboxes, by mapping mailbox status bits into their process data.
    fn read_bits(&mut self, fmmu: usize, physical: u16, of: &mut [u8]) -> bool {
        let (first, last, from) = (self.memory[fmmu + 6], self.memory[fmmu + 7], self.memory[fmmu + 10]);
        let (Some(to), true) = (of.first_mut(), first <= last && last < 8 && from < 8) else { return false };
        let mut byte = [0];
        if !self.read(physical, &mut byte, false) {
            return false;
        }
        let mask = ((1u16 << (last + 1)) - (1u16 << first)) as u8;
        *to = *to & !mask | (byte[0] >> from << first) & mask;
        true
    }
}

fn sync_manager(index: usize) -> usize {
    usize::from(reg::SYNC_MANAGER) + index * usize::from(reg::SYNC_MANAGER_LEN)
}

/// Returns true for registers that a main device may write.
fn is_writable(address: usize) -> bool {
    match address {
        0x0010..=0x0013 | 0x0100..=0x0103 | 0x0120..=0x0121 | 0x0200..=0x020F | 0x0300..=0x0313 | 0x0400..=0x0421 | 0x0500..=0x050F => true,
        0x0600..=0x067F => true,
        // The status and the subdevice's side of a SyncManager are not writable.
        0x0800..=0x083F => !matches!(address & 7, 5 | 7),
        // These are the digital outputs.
        0x0F00..=0x0F0F => true,
        0x0920..=0x092B | 0x0930..=0x0935 | 0x0980..=0x09CF => true,
        _ => address >= usize::from(reg::MEMORY),
    }
}
