// SPDX-License-Identifier: Apache-2.0
//! Life cycle of the driver: brings its drives to OP, exchanges data, and comes to rest.
use super::axis::Axis;
use super::counters::Count;
use super::services::{Beside, Mailboxes};
use super::terminal::Terminal;
use crate::main_device::{Bus, Clocks, Cycle, FrameAnswer, Pdos, Station, Subdevice, SubdeviceSettings, Sync0, bring_up, open_link, take};
use crate::registers::AL_CONTROL;
use crate::sii;
use crate::states::{State, describe};
use cia402::Commander;
use cia402::axis::ServiceState;
use cia402::identity::{self, Identity};
use device::{Channel, Counters, DeviceError, Driver, Services};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time limit for drives to reach OP while process data arrive, and time limit for an answer outside the cycle.
const TO_OP: Duration = Duration::from_secs(10);
/// Maximum number of frames that command a drive to reset its fault. A reset takes the drive several cycles.
const RESETS: usize = 1_000;
const ANSWER: Duration = Duration::from_millis(200);
/// Time limit for an answer in lockstep, where the speed of a segment is irrelevant; only a segment that never answers reaches it.
const ANSWER_IN_LOCKSTEP: Duration = Duration::from_secs(5);

pub(super) struct EtherCat {
    interface: String,
    axes: Vec<Axis>,
    terminals: Vec<Terminal>,
    channels: Vec<Channel>,
    timeout_ns: i64,
    lost_after: u32,
    lockstep: bool,
    sync0: Option<Sync0>,
    /// Time at which the device was opened, on this host's clock and on that of its source, ns.
    opened: (Instant, i64),
    counters: Arc<Counters>,
    beside: Arc<Beside>,
    /// Stations: axes first, then terminals.
    stations: Vec<Station>,
    cycle: Option<Cycle>,
    /// Number of consecutive failed cycles. A cycle fails if the answer is missing or incomplete, or if a subdevice is not in OP.
    missed: u32,
    written_ns: i64,
}

impl EtherCat {
    pub fn new(interface: String, axes: Vec<Axis>, channels: Vec<Channel>, timeout_ns: i64, lost_after: u32, sync0: Option<Sync0>) -> EtherCat {
        let beside = ServiceState::new(&format!("the segment on '{interface}'"), axes.iter().map(|axis| axis.moved.beside()));
        EtherCat {
            beside: Arc::new(Beside(beside)),
            interface,
            axes,
            terminals: Vec::new(),
            channels,
            timeout_ns,
            lost_after,
            lockstep: false,
            sync0,
            opened: (Instant::now(), 0),
            counters: Arc::new(Counters::new(Count::WORDS)),
            stations: Vec::new(),
            cycle: None,
            missed: 0,
            written_ns: 0,
        }
    }

    /// Returns the driver in its variant for virtual time: its readings wait for the pending frame, and its drives have no watchdog.
    pub fn in_lockstep(self) -> EtherCat {
        EtherCat { lockstep: true, ..self }
    }

    /// Adds these terminals to the driver.
    pub fn with_terminals(self, terminals: Vec<Terminal>) -> EtherCat {
        EtherCat { terminals, ..self }
    }

    fn start(&mut self) -> Result<(), String> {
        let mut bus = Bus::open(&self.interface)?;
        let asked: Vec<_> = self.axes.iter().map(|axis| (axis.at, axis.pdos(), axis.settings(self.sync0))).collect();
        let axes = asked.iter().map(|(position, pdos, settings)| SubdeviceSettings { position: *position, pdos, settings, is_synced: true });
        let terminals = self.terminals.iter().map(|of| SubdeviceSettings { position: of.at, pdos: &Pdos::Terminal, settings: &[], is_synced: false });
        let wanted: Vec<SubdeviceSettings<'_>> = axes.chain(terminals).collect();
        let opened = self.opened;
        let now_ns = move || now_ns(opened);
        let clocks = self.sync0.map(|sync0| Clocks { sync0, now_ns: &now_ns });
        let found = take(&mut bus)?;
        self.identify(&found)?;
        let line = bring_up(&mut bus, &found, &wanted, if self.lockstep { 0 } else { self.timeout_ns }, clocks.as_ref())?;
        for (axis, station) in self.axes.iter_mut().zip(&line.stations) {
            axis.map(&station.mapping, station.outputs_at, station.inputs_at)?;
        }
        for (terminal, station) in self.terminals.iter_mut().zip(&line.stations[self.axes.len()..]) {
            terminal.map(&station.mapping, station.outputs_at, station.inputs_at)?;
        }
        let too_many = || format!("the process data of {} axes and {} terminals do not fit into a frame", self.axes.len(), self.terminals.len());
        let mut cycle = Cycle::new(open_link(&self.interface)?, &line).ok_or_else(too_many)?;
        let stations = line.stations;
        self.exchange_idle(&mut cycle)?;
        for station in &stations {
            let control = State::Op as u16;
            bus.write(station.subdevice.station, AL_CONTROL, &control.to_le_bytes())?;
        }
        let until = Instant::now() + TO_OP;
        while let Some(station) = (0..stations.len()).find(|of| cycle.state(*of) != Some((State::Op as u16, 0))) {
            if Instant::now() > until {
                let state = cycle.state(station).map_or_else(|| "gone".to_owned(), |(status, code)| describe(status, code));
                return Err(format!("{} does not go to OP: it is in {state}", stations[station].subdevice.title()));
            }
            self.exchange_idle(&mut cycle)?;
        }
        // Outputs that arrived before SYNC0 wait for it.
        let until = Instant::now() + TO_OP;
        while line.synced_from_ns.is_some_and(|from_ns| !cycle.has_come(from_ns)) {
            if Instant::now() > until {
                let clock = stations.first().map_or_else(String::new, |station| station.subdevice.title());
                return Err(format!(
                    "the reference clock of the line ({clock}, the first one) did not reach the first SYNC0 within {} s: it is not running",
                    TO_OP.as_secs()
                ));
            }
            self.exchange_idle(&mut cycle)?;
        }
        self.reset_faults(&mut cycle)?;
        let of_axes = stations[..self.axes.len()].iter().map(|station| station.subdevice.mailbox()).collect::<Result<_, _>>()?;
        self.beside.0.reach(Mailboxes { bus: Bus::open(&self.interface)?, of_axes });
        (self.stations, self.cycle, self.missed) = (stations, Some(cycle), 0);
        Ok(())
    }

    /// Checks that each drive on the line is the one that its axis had before, or is configured to have; otherwise refuses the line.
    fn identify(&self, found: &[Subdevice]) -> Result<(), String> {
        let opened = (0..self.axes.len() + self.terminals.len()).filter_map(|of| {
            let (title, name, at, expected) = self.member(of);
            let sii::Identity { vendor, product, revision, serial, alias, .. } = found.get(at)?.contents.identity;
            Some(identity::BusDevice {
                title: format!("{title} '{name}' at place {at}"),
                place: format!("ethercat {} {at} {name}", self.interface),
                expected,
                found: Identity { vendor, product, revision, serial, alias },
            })
        });
        identity::check(&opened.collect::<Vec<_>>())
    }

    /// Returns the axis or terminal at this station: its kind, name, position and expected identity.
    fn member(&self, of: usize) -> (&'static str, &str, usize, identity::ExpectedIdentity) {
        match self.axes.get(of) {
            Some(axis) => ("axis", axis.name(), axis.at, axis.expected),
            None => {
                let terminal = &self.terminals[of - self.axes.len()];
                ("terminal", &terminal.name, terminal.at, terminal.expected)
            }
        }
    }

    /// Exchanges one frame without commanding an axis.
    fn exchange_idle(&mut self, cycle: &mut Cycle) -> Result<(), String> {
        let until = Instant::now() + TO_OP;
        loop {
            for axis in &mut self.axes {
                axis.tell_idle(cycle.outputs());
            }
            self.terminals.iter().for_each(|terminal| terminal.be_safe(cycle.outputs()));
            cycle.send(self.sync0.map(|_| now_ns(self.opened))).map_err(|error| format!("interface '{}': {error}", self.interface))?;
            let replied = cycle.wait(ANSWER).map_err(|error| format!("interface '{}': {error}", self.interface))?;
            if replied == FrameAnswer::Whole || replied == FrameAnswer::Short {
                self.axes.iter_mut().for_each(|axis| axis.look(cycle.newest()));
                return Ok(());
            }
            if Instant::now() > until {
                return Err(format!("no frame of the cycle comes back on interface '{}'", self.interface));
            }
        }
    }

    /// Resets existing faults. A fault that recurs is reported when the axis is engaged.
    fn reset_faults(&mut self, cycle: &mut Cycle) -> Result<(), String> {
        for _ in 0..RESETS {
            let mut faulty = self.axes.iter_mut().map(|axis| &mut axis.moved.commander).filter(|commander| commander.is_faulty()).peekable();
            if faulty.peek().is_none() {
                break;
            }
            faulty.for_each(Commander::reset);
            self.exchange_idle(cycle)?;
        }
        self.exchange_idle(cycle)
    }

    /// Returns the reason why cycles fail: the subdevice that does not answer, or a subdevice's state.
    fn lost(&self, replied: FrameAnswer) -> DeviceError {
        let cycles = self.missed;
        let on = &self.interface;
        let message = match (replied, &self.cycle) {
            (FrameAnswer::Short, Some(cycle)) => self.what_is_short(cycle),
            _ => format!(
                "nothing came back on interface '{on}' for {cycles} cycles: the cable to '{}' is unplugged, or it has no power",
                (0..self.stations.len()).map(|of| self.member(of)).min_by_key(|(_, _, at, _)| *at).map_or("", |(_, name, ..)| name)
            ),
        };
        DeviceError { message }
    }

    fn what_is_short(&self, cycle: &Cycle) -> String {
        let silent = (0..self.stations.len()).filter(|of| cycle.state(*of).is_none()).min_by_key(|of| self.member(*of).2);
        if let Some(of) = silent {
            let (title, name, place, _) = self.member(of);
            return format!(
                "{title} '{name}' at place {place} does not answer on interface '{}': the cable before it is unplugged, or it has no power",
                self.interface
            );
        }
        let left = (0..self.stations.len()).find_map(|of| cycle.state(of).filter(|(status, _)| *status != State::Op as u16).map(|state| (of, state)));
        match left {
            Some((of, (status, code))) if of < self.axes.len() => {
                format!("the drive of axis '{}' has left OP: it is in {}", self.axes[of].name(), describe(status, code))
            }
            Some((of, (status, code))) => format!("terminal '{}' has left OP: it is in {}", self.member(of).1, describe(status, code)),
            None => format!("all subdevices on interface '{}' answer, but not all of them process their data", self.interface),
        }
    }

    /// Stores the latest answers of all stations.
    fn show(&mut self, readings: &mut [u8]) {
        let Some(cycle) = &self.cycle else { return };
        for axis in &mut self.axes {
            axis.read(cycle.newest(), readings);
        }
        for terminal in &self.terminals {
            terminal.read(cycle.newest(), readings);
        }
    }
}

impl Driver for EtherCat {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.written_ns = now_ns;
        self.opened = (Instant::now(), now_ns);
        self.start().map_err(|message| DeviceError { message })
    }

    fn read(&mut self, _: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let counters = &self.counters;
        let Some(cycle) = &mut self.cycle else { return Err(not_open()) };
        let replied = if self.lockstep { cycle.wait(ANSWER_IN_LOCKSTEP) } else { cycle.receive(|_| counters.add(Count::Refused, 1)) };
        let replied = replied.unwrap_or(FrameAnswer::Nothing);
        match replied {
            FrameAnswer::Whole => {
                // A subdevice that has left OP still answers, but ignores outputs.
                self.missed = if cycle.all_are_in(State::Op) { 0 } else { self.missed + 1 };
                if let Some(timing) = cycle.timing() {
                    counters.set(Count::Difference, timing.difference_ns.into());
                    counters.set(Count::Reference, timing.reference_ns.unsigned_abs().into());
                }
                self.show(readings);
            }
            FrameAnswer::NotAsked => self.show(readings),
            FrameAnswer::Short | FrameAnswer::Nothing => {
                counters.add(if replied == FrameAnswer::Short { Count::Short } else { Count::Lost }, 1);
                self.missed += 1;
                if self.missed >= self.lost_after {
                    self.beside.0.homes.end();
                    return Err(self.lost(replied));
                }
            }
        }
        match self.axes.iter().find_map(|axis| axis.moved.fault()) {
            Some(message) => Err(DeviceError { message }),
            None if self.missed >= self.lost_after => {
                self.beside.0.homes.end();
                Err(self.lost(FrameAnswer::Short))
            }
            None => Ok(()),
        }
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        let Some(cycle) = &mut self.cycle else { return Err(not_open()) };
        let span_s = (release_ns - self.written_ns).max(0) as f64 * 1e-9;
        self.written_ns = release_ns;
        for (index, axis) in self.axes.iter_mut().enumerate() {
            let (can_home, commander) = (axis.can_home(), &mut axis.moved.commander);
            if self.beside.0.resets(index) {
                commander.reset();
            }
            self.beside.0.homes.serve(index, commander, can_home, engaged[index]);
            axis.write(commands, engaged[index], span_s, cycle.outputs());
        }
        self.terminals.iter().for_each(|terminal| terminal.write(commands, cycle.outputs()));
        self.counters.add(Count::Cycles, 1);
        // A frame that cannot be sent does not return, which the readings show.
        let _ = cycle.send(self.sync0.map(|_| now_ns(self.opened)));
        Ok(())
    }

    fn safe_state(&mut self) {
        self.beside.0.homes.rest();
        let Some(cycle) = &mut self.cycle else { return };
        for axis in &mut self.axes {
            axis.moved.commander.stop();
            axis.tell_idle(cycle.outputs());
        }
        self.terminals.iter().for_each(|terminal| terminal.be_safe(cycle.outputs()));
        let _ = cycle.send(self.sync0.map(|_| now_ns(self.opened)));
    }

    fn close(&mut self) {
        self.safe_state();
        self.cycle = None;
        self.beside.0.leave();
    }

    fn watchdog_ns(&self) -> Option<i64> {
        Some(self.timeout_ns)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.beside.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}

/// Returns the current time of the source, derived from this host's clock.
fn now_ns((opened, opened_ns): (Instant, i64)) -> u64 {
    opened_ns.unsigned_abs() + opened.elapsed().as_nanos() as u64
}

fn not_open() -> DeviceError {
    DeviceError { message: "the segment is not open".to_owned() }
}
