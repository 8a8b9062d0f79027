// SPDX-License-Identifier: Apache-2.0
//! An emulated subdevice: its mailbox, its process data, its clock.
mod states;

use super::clock::Clock;
use super::controller::{Controller, Wiring, WriteEffects};
use super::identity::{identify, map};
use super::options::{DriveOptions, TerminalOptions};
use super::sdo::{MAILBOX_LEN, SdoServer};
use super::terminal::Terminal;
use crate::frames::{Command, Datagram};
use crate::registers as reg;
use crate::sii::{self, Contents, Identity, SyncManager};
use crate::states::{ERROR, State};
use cia402::emulated::{Drive, MappedObject, Objects, PRODUCT, VENDOR};

/// Addresses of a subdevice's mailboxes.
const MAILBOXES: [u16; 2] = [0x1000, 0x1080];
const OUTPUTS: u16 = 0x1100;
const INPUTS: u16 = 0x1180;
/// SyncManagers for the process data of a subdevice with a mailbox.
const DRIVE_OUTPUTS: usize = 2;
const DRIVE_INPUTS: usize = 3;
/// AL status code for an expired watchdog.
const WATCHDOG: u16 = 0x001B;

/// History of a drive's clock and SYNC0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SyncHistory {
    /// Delay from the reference clock, as written by a main device, ns.
    pub delay_ns: u32,
    /// Difference between the drive's time and that of the reference clock, ns.
    pub difference_ns: i64,
    /// Number of SYNC0 events in OP, and number of such events without new outputs.
    pub sync0: u64,
    pub missed: u64,
    /// Minimum and maximum time by which new outputs preceded SYNC0, ns.
    pub margin_ns_min: u64,
    pub margin_ns_max: u64,
}

/// Application layer of the subdevice.
enum Application {
    Drive(Drive),
    Terminal(Terminal),
}

/// A drive or a terminal on the line.
pub struct Subdevice {
    options: DriveOptions,
    serial: u32,
    controller: Controller,
    objects: Objects,
    application: Application,
    sdo: SdoServer,
    reply: [u8; MAILBOX_LEN],
    state: State,
    /// Objects that a drive exchanges.
    outputs: Vec<MappedObject>,
    inputs: Vec<MappedObject>,
    written_ns: u64,
    stepped_ns: u64,
    synced: SyncHistory,
    /// True if outputs are waiting for SYNC0.
    is_fresh: bool,
    pub is_on: bool,
}

impl Subdevice {
    pub fn new(options: &DriveOptions, serial: u32) -> Subdevice {
        let mut objects = Objects::default();
        identify(&mut objects, options, serial);
        let application = match &options.terminal {
            Some(terminal) => {
                let terminal = Terminal::new(terminal);
                terminal.map(&mut objects);
                Application::Terminal(terminal)
            }
            None => {
                let mut drive = Drive::new(&mut objects, options.position);
                drive.set_limits(options.limits);
                drive.set_load(options.falls);
                map(&mut objects);
                Application::Drive(drive)
            }
        };
        let (contents, wiring) = contents(options, serial, &application);
        Subdevice {
            options: options.clone(),
            serial,
            controller: Controller::new(sii::build(&contents), wiring, Clock::new(u64::from(serial) * 1_000_003, options.clock_ppm)),
            objects,
            application,
            sdo: SdoServer::new(),
            reply: [0; MAILBOX_LEN],
            state: State::Init,
            outputs: Vec::new(),
            inputs: Vec::new(),
            written_ns: 0,
            stepped_ns: 0,
            synced: SyncHistory::default(),
            is_fresh: false,
            is_on: true,
        }
    }

    /// Switches the power supply. A subdevice that is switched on again has been reset, but its axis has not moved.
    pub fn power(&mut self, is_on: bool) {
        if is_on && !self.is_on {
            let options = DriveOptions { position: self.position(), ..self.options.clone() };
            *self = Subdevice::new(&options, self.serial);
        }
        self.is_on = is_on;
    }

    /// Returns the position in counts.
    pub fn position(&self) -> i32 {
        self.number(0x6064) as i32
    }

    /// Returns an object dictionary entry as a number; 0 if it does not exist.
    pub fn number(&self, index: u16) -> i64 {
        self.objects.find(crate::coe::Entry { index, sub: 0 }).map_or(0, |at| self.objects.number(at))
    }

    pub fn state(&self) -> State {
        self.state
    }

    /// Returns the name of the state, and of the error.
    pub fn status(&self) -> String {
        crate::states::describe(self.controller.word(reg::AL_STATUS), self.controller.word(reg::AL_CODE))
    }

    pub fn fail(&mut self, error: u16) {
        if let Application::Drive(drive) = &mut self.application {
            drive.fail(error, &mut self.objects);
        }
    }

    /// Returns the terminal, if the subdevice is one.
    pub fn terminal(&self) -> Option<&Terminal> {
        match &self.application {
            Application::Terminal(terminal) => Some(terminal),
            Application::Drive(_) => None,
        }
    }

    /// Sets the value at an input of a terminal.
    pub fn put(&mut self, number: usize, value: i64) {
        if let Application::Terminal(terminal) = &mut self.application {
            terminal.put(number, value);
        }
        self.give_inputs();
    }

    fn lose_communication(&mut self) {
        match &mut self.application {
            Application::Drive(drive) => drive.lose_communication(&mut self.objects),
            Application::Terminal(terminal) => terminal.lose_communication(),
        }
    }

    pub fn set_enable_input(&mut self, is_closed: bool) {
        if let Application::Drive(drive) = &mut self.application {
            drive.set_enable_input(is_closed);
        }
    }

    /// Sets which ports have a neighbour.
    pub fn set_links(&mut self, is_last: bool) {
        // The application runs; there is communication on port 0 and, unless it is the last, on port 1; the other ports are closed.
        let links = if is_last { 0x0010 | 0x0200 | 0x0400 } else { 0x0030 | 0x0200 | 0x0800 };
        self.controller.set_word(reg::DL_STATUS, 0x0001 | links | 0x1000 | 0x4000);
    }

    /// Returns the time that a frame takes from the previous subdevice, ns.
    pub fn cable_ns(&self) -> u64 {
        self.options.cable_ns.unwrap_or(350)
    }

    /// Returns the subdevice's system time at a true time.
    pub fn system_ns(&self, now_ns: u64) -> u64 {
        let mut clock = self.controller.clock.clone();
        clock.go_on(now_ns);
        self.controller.system_ns().wrapping_add(clock.local_ns()).wrapping_sub(self.controller.clock.local_ns())
    }

    pub fn synced(&self) -> SyncHistory {
        let delay = [self.controller.word(reg::DC_DELAY), self.controller.word(reg::DC_DELAY + 2)];
        let shown = self.controller.clock.difference();
        let magnitude = i64::from(shown & 0x7FFF_FFFF);
        let difference_ns = if shown >> 31 == 0 { magnitude } else { -magnitude };
        SyncHistory { delay_ns: u32::from(delay[0]) | u32::from(delay[1]) << 16, difference_ns, ..self.synced }
    }

    /// Counts the SYNC0 events since the last frame, and applies the outputs that arrived before these events.
    fn sync(&mut self) {
        let system_ns = self.controller.system_ns();
        let came = self.controller.clock.synced(system_ns);
        if came == 0 || self.state != State::Op {
            return;
        }
        self.synced.sync0 = self.synced.sync0.saturating_add(came);
        self.synced.missed = self.synced.missed.saturating_add(came - u64::from(self.is_fresh));
        if std::mem::take(&mut self.is_fresh) {
            self.take_outputs();
        }
    }

    /// Records that new outputs have arrived; they take effect at SYNC0 if it is active.
    fn outputs_came(&mut self) {
        let Some(next_ns) = self.controller.clock.next_sync_ns() else { return self.take_outputs() };
        let margin_ns = next_ns.saturating_sub(self.controller.system_ns());
        let synced = &mut self.synced;
        let is_first = synced.margin_ns_max == 0;
        synced.margin_ns_min = if is_first { margin_ns } else { synced.margin_ns_min.min(margin_ns) };
        synced.margin_ns_max = synced.margin_ns_max.max(margin_ns);
        self.is_fresh = true;
    }

    /// Clears the SYNC0 history.
    pub fn forget_synced(&mut self) {
        self.synced = SyncHistory::default();
    }

    /// Advances the axis, clock and watchdog to this time. A frame arrives at this time, and returns from the subsequent subdevices after
    /// `behind_ns`.
    pub fn go_on(&mut self, now_ns: u64, behind_ns: Option<u64>) {
        let span_ns = if self.stepped_ns == 0 { 0 } else { now_ns.saturating_sub(self.stepped_ns) };
        self.stepped_ns = now_ns;
        self.controller.tell_time(now_ns, behind_ns);
        self.sync();
        let watchdog_ns = self.controller.watchdog_ns();
        let is_late = self.options.watchdog != Some(false) && watchdog_ns > 0 && now_ns.saturating_sub(self.written_ns) > watchdog_ns;
        if self.state == State::Op && is_late && self.is_watched() {
            self.controller.set_word(reg::WATCHDOG_STATUS, 0);
            self.lose_communication();
            self.set_state(State::SafeOp, WATCHDOG);
        }
        if span_ns > 0 {
            if let Application::Drive(drive) = &mut self.application {
                drive.step(&mut self.objects, span_ns as f64 * 1e-9);
            }
            self.give_inputs();
        }
    }

    /// Returns true if the subdevice leaves OP when outputs are missing.
    fn is_watched(&self) -> bool {
        self.controller.wiring().outputs.iter().any(|manager| self.controller.is_watched(*manager))
    }

    /// Handles a datagram addressed to this subdevice or to all.
    pub fn access(&mut self, of: &Datagram, frame: &mut [u8], reads: bool, writes: bool, now_ns: u64) {
        let memory = (of.address >> 16) as u16;
        let is_all = matches!(of.command, Command::AllRead | Command::AllReadWrite);
        let mut counter = of.working_counter(frame);
        let data = of.data_mut(frame);
        // Received bytes are written, even if read bytes replace them in the frame.
        let mut came = [0; crate::frames::FRAME_MAX];
        came[..of.len].copy_from_slice(data);
        if reads && self.controller.read(memory, data, is_all) {
            counter = counter.wrapping_add(1);
        }
        if writes && let Some(changed) = self.controller.write(memory, &came[..of.len]) {
            counter = counter.wrapping_add(if reads { 2 } else { 1 });
            self.look_after(changed, now_ns);
        }
        of.set_working_counter(frame, counter);
    }

    /// Handles a logical datagram.
    pub fn logical(&mut self, of: &Datagram, frame: &mut [u8], now_ns: u64) {
        let reads = of.command != Command::LogicalWrite;
        let writes = of.command != Command::LogicalRead;
        let (done, changed) = self.controller.logical(of.address, of.data_mut(frame), reads, writes);
        let more = if of.command == Command::LogicalReadWrite { done } else { u16::from(done != 0) };
        of.set_working_counter(frame, of.working_counter(frame).wrapping_add(more));
        self.look_after(changed, now_ns);
    }

    pub fn station(&self) -> u16 {
        self.controller.word(reg::STATION)
    }

    fn look_after(&mut self, changed: WriteEffects, now_ns: u64) {
        if changed.outputs {
            self.written_ns = now_ns;
            self.controller.set_word(reg::WATCHDOG_STATUS, 1);
            self.outputs_came();
        }
        if changed.mailbox {
            self.answer_mailbox();
        }
        if changed.repeat {
            self.controller.acknowledge_repeat();
            self.put_reply();
        }
        if changed.al_control {
            self.change_state(now_ns);
        }
    }

    fn answer_mailbox(&mut self) {
        self.controller.set_full(0, false);
        let message = self.controller.buffer(0);
        if self.state >= State::PreOp && self.sdo.answer(&mut self.objects, message, self.state == State::PreOp, &mut self.reply).is_some() {
            self.put_reply();
        }
    }

    fn put_reply(&mut self) {
        let to = self.controller.buffer_mut(1);
        let len = to.len().min(self.reply.len());
        to[..len].copy_from_slice(&self.reply[..len]);
        self.controller.set_full(1, true);
    }

    fn take_outputs(&mut self) {
        if self.state != State::Op {
            return;
        }
        if let Application::Terminal(terminal) = &mut self.application {
            let mut at = 0;
            for manager in &self.controller.wiring().outputs {
                let bytes = self.controller.buffer(*manager);
                terminal.take(at, bytes);
                at += bytes.len();
            }
            return;
        }
        let mut from = self.controller.buffer(DRIVE_OUTPUTS);
        for mapped in &self.outputs {
            let Some((value, rest)) = from.split_at_checked(mapped.len) else { return };
            self.objects.set_value(mapped.of, value);
            from = rest;
        }
    }

    fn give_inputs(&mut self) {
        if let Application::Terminal(terminal) = &self.application {
            if let Some(manager) = self.controller.wiring().inputs.first().copied() {
                let to = self.controller.buffer_mut(manager);
                let len = to.len().min(terminal.inputs().len());
                to[..len].copy_from_slice(&terminal.inputs()[..len]);
            }
            return;
        }
        let mut to = self.controller.buffer_mut(DRIVE_INPUTS);
        for mapped in &self.inputs {
            let Some((value, rest)) = to.split_at_mut_checked(mapped.len) else { return };
            value.copy_from_slice(self.objects.value(mapped.of));
            to = rest;
        }
    }

    fn set_state(&mut self, state: State, code: u16) {
        self.state = state;
        self.controller.set_word(reg::AL_STATUS, state as u16 | if code == 0 { 0 } else { ERROR });
        self.controller.set_word(reg::AL_CODE, code);
    }
}

/// Returns the contents of the EEPROM, and the SyncManagers and their purposes.
fn contents(options: &DriveOptions, serial: u32, application: &Application) -> (Contents, Wiring) {
    // A main device may assume that subdevices of one product exchange the same objects.
    let product = options.terminal.as_ref().map_or(PRODUCT, TerminalOptions::product);
    let identity = Identity { vendor: VENDOR, product, revision: 1, serial, alias: options.alias, name: options.name.clone() };
    let terminal = match application {
        Application::Terminal(terminal) => Some(terminal),
        Application::Drive(_) => None,
    };
    let (inputs, outputs) = terminal.map(Terminal::pdos).unwrap_or_default();
    let contents = |has_coe, sync_managers| Contents { identity, has_coe, sync_managers, fmmus: vec![1, 2], inputs, outputs };
    if let Some(terminal) = terminal.filter(|terminal| !terminal.has_objects()) {
        let managers = terminal.digital_managers();
        let of = |kind| managers.iter().enumerate().filter(move |(_, manager)| manager.kind == kind).map(|(number, _)| number).collect();
        let wiring = Wiring { has_mailbox: false, outputs: of(3), inputs: of(4) };
        return (contents(false, managers), wiring);
    }
    let watched = if options.watchdog == Some(false) { 0x24 } else { 0x64 };
    let manager = |start, len: usize, control, kind| SyncManager { start, len: len as u16, control, enable: 1, kind };
    let sync_managers = vec![
        manager(MAILBOXES[0], MAILBOX_LEN, 0x26, 1),
        manager(MAILBOXES[1], MAILBOX_LEN, 0x22, 2),
        manager(OUTPUTS, 0, watched, 3),
        manager(INPUTS, 0, 0x20, 4),
    ];
    (contents(true, sync_managers), Wiring { has_mailbox: true, outputs: vec![DRIVE_OUTPUTS], inputs: vec![DRIVE_INPUTS] })
}
