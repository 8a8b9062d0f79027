// SPDX-License-Identifier: Apache-2.0
//! Life cycle of the driver: makes its nodes operational, exchanges data, and comes to rest.
use super::bring_up::{Terms, configure, identify};
use super::counters::Count;
use super::heard::Missing;
use super::options::Options;
use super::services::{Beside, Nodes};
use super::station::{Station, What};
use crate::client::Client;
use crate::frame::{self, Came, Frame};
use crate::interface::Interface;
use crate::link::Link;
use crate::message::{self, Message};
use crate::nmt::{self, Command, NODE_MAX, NodeState};
use cia402::Commander;
use cia402::axis::ServiceState;
use cia402::identity::{self, BusDevice};
use device::{Channel, Counters, DeviceError, Driver, SafeHandle, Services};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Messages that the cycle receives: emergency messages, process data, heartbeats.
const HEARD: [(u16, u16); 6] = [(0x080, 0x780), (0x180, 0x780), (0x280, 0x780), (0x380, 0x780), (0x480, 0x780), (0x700, 0x780)];
/// Maximum number of frames to read in a cycle; the rest are read in the next one.
const TAKEN_MAX: usize = 1024;
/// Time limits for nodes to send their first process data, and for one exchange outside the cycle.
const TO_OPERATION: Duration = Duration::from_secs(5);
const ANSWER: Duration = Duration::from_millis(100);
/// Time limit for accessing an object dictionary entry of a node that may be busy with its non-volatile memory.
pub const OBJECT: Duration = Duration::from_secs(1);

pub struct CanOpen {
    interface: Interface,
    /// Stations: axes first, then modules.
    stations: Vec<Station>,
    /// Index of each node's station.
    by_node: [Option<u8>; NODE_MAX as usize + 1],
    channels: Vec<Channel>,
    terms: Terms,
    lost_after: u32,
    counters: Arc<Counters>,
    beside: Arc<Beside>,
    link: Option<Box<dyn Link>>,
    /// True if a SYNC has been sent since the last reading.
    has_asked: bool,
    is_bus_off: bool,
    written_ns: Option<i64>,
    beaten_ns: Option<i64>,
}

impl CanOpen {
    pub fn new(options: &Options, interface: Interface, stations: Vec<Station>, channels: Vec<Channel>) -> CanOpen {
        let mut by_node = [None; NODE_MAX as usize + 1];
        for (index, station) in stations.iter().enumerate() {
            by_node[usize::from(station.node & NODE_MAX)] = Some(index as u8);
        }
        let shared = ServiceState::new(&format!("the bus on '{interface}'"), stations.iter().map(Station::beside));
        let data_sheets = stations.iter().map(|station| station.eds.clone()).collect();
        CanOpen {
            beside: Arc::new(Beside { shared, axes: options.axes.len(), data_sheets }),
            interface,
            stations,
            by_node,
            channels,
            terms: Terms { own_node: options.own_node, timeout_ns: options.timeout_ns, heartbeat_ns: options.heartbeat_ns, cycle_ns: options.cycle_ns },
            lost_after: options.lost_after,
            counters: Arc::new(Counters::new(Count::WORDS)),
            link: None,
            has_asked: false,
            is_bus_off: false,
            written_ns: None,
            beaten_ns: None,
        }
    }

    fn on(&self, error: impl std::fmt::Display) -> String {
        format!("interface '{}': {error}", self.interface)
    }

    fn start(&mut self) -> Result<(), String> {
        self.link = None;
        let mut client = Client::open(&self.interface, OBJECT).map_err(|error| self.on(error))?;
        self.identify(&mut client)?;
        for station in &mut self.stations {
            station.expect();
            configure(&mut client, station, &self.terms)?;
        }
        self.link = Some(self.interface.open(&HEARD).map_err(|error| self.on(error))?);
        for node in self.stations.iter().map(|station| station.node) {
            client.send(&Command::Start.frame(node)).map_err(|error| error.to_string())?;
        }
        (self.is_bus_off, self.written_ns, self.beaten_ns) = (false, None, None);
        self.exchange_idle()?;
        self.reset_faults()?;
        // Reports from before the start of the nodes are out of date.
        self.stations.iter_mut().for_each(|station| station.heard.expect());
        self.has_asked = false;
        self.beside.shared.reach(Nodes { client, of_axes: self.stations.iter().map(|station| station.node).collect() });
        Ok(())
    }

    /// Checks that each node is the one that its axis or module had before or is configured to have; otherwise refuses the bus.
    fn identify(&self, client: &mut Client) -> Result<(), String> {
        let opened = self.stations.iter().map(|station| {
            let place = format!("canopen {} {} {}", self.interface, station.node, station.name);
            Ok(BusDevice { title: station.title(), place, expected: station.expected, found: identify(client, station)? })
        });
        identity::check(&opened.collect::<Result<Vec<_>, String>>()?)
    }

    /// Exchanges process data outside the cycle without commanding an axis, repeatedly until all drives have sent their process data.
    fn exchange_idle(&mut self) -> Result<(), String> {
        let end = Instant::now() + TO_OPERATION;
        loop {
            self.stations.iter_mut().for_each(|station| station.heard.is_fresh = false);
            self.send_idle();
            let until = Instant::now() + ANSWER;
            loop {
                self.receive(0).map_err(|error| self.on(error))?;
                let Some(silent) = self.stations.iter().find(|station| !station.heard.is_fresh && station.answers()) else { return Ok(()) };
                if Instant::now() > end {
                    return Err(format!("{} sent no process data within {} s of its start", silent.title(), TO_OPERATION.as_secs()));
                }
                if Instant::now() > until {
                    break;
                }
                self.link.iter_mut().for_each(|link| link.wait(ANSWER));
            }
        }
    }

    /// Resets existing faults. A fault that recurs is reported when the axis is engaged.
    fn reset_faults(&mut self) -> Result<(), String> {
        for _ in 0..4 {
            let commanders = self.stations.iter_mut().filter_map(Station::axis_mut).map(|axis| &mut axis.moved.commander);
            commanders.filter(|commander| commander.is_faulty()).for_each(Commander::reset);
            self.exchange_idle()?;
        }
        self.exchange_idle()
    }

    /// Processes all received frames.
    fn receive(&mut self, now_ns: i64) -> std::io::Result<()> {
        for _ in 0..TAKEN_MAX {
            let Some(link) = &mut self.link else { return Ok(()) };
            match link.receive()? {
                None => break,
                Some(Came::Frame(frame)) => self.take(&frame, now_ns),
                Some(Came::Report { classes, controller }) => self.note(classes, controller),
                Some(Came::Strange) => self.counters.add(Count::Refused, 1),
            }
        }
        let overflowed = self.link.as_ref().map_or(0, |link| link.overflowed());
        self.counters.set(Count::Overflowed, u64::from(overflowed));
        Ok(())
    }

    fn take(&mut self, frame: &Frame, now_ns: i64) {
        // This driver does not serve the other nodes of the bus.
        let Some(station) = self.by_node[usize::from(frame.id & 0x7F)] else { return };
        let station = &mut self.stations[usize::from(station)];
        match message::read(frame) {
            Some(Message::Pdo { number, bytes, .. }) if station.take(number, bytes, now_ns) => {}
            Some(Message::Heartbeat { state, .. }) => station.heard.heartbeat(now_ns, state),
            Some(Message::Emergency { code, .. }) => {
                station.heard.data(now_ns);
                station.heed(code);
                self.counters.add(Count::Emergencies, 1);
            }
            _ => self.counters.add(Count::Refused, 1),
        }
    }

    /// Records a report about the bus from the adapter.
    fn note(&mut self, classes: u32, controller: u8) {
        if classes & frame::BUS_OFF != 0 {
            self.is_bus_off = true;
            self.counters.add(Count::BusOff, 1);
        }
        if classes & frame::RESTARTED != 0 {
            self.is_bus_off = false;
        }
        if classes & frame::CONTROLLER != 0 && controller & frame::PASSIVE != 0 {
            self.counters.add(Count::Passive, 1);
        }
    }

    fn send(&mut self, frame: &Frame) {
        let sent = self.link.as_mut().is_some_and(|link| link.send(frame).is_ok());
        // A frame that is not sent brings no process data back, which the readings show.
        self.counters.add(Count::Unsent, u64::from(!sent));
    }

    fn send_idle(&mut self) {
        self.stations.iter_mut().for_each(Station::tell_idle);
        self.send_told();
        self.send(&nmt::sync());
    }

    /// Sends each node its commands.
    fn send_told(&mut self) {
        for index in 0..self.stations.len() {
            for frame in self.stations[index].frames().into_iter().flatten() {
                self.send(&frame);
            }
        }
    }

    /// Returns the problem with the bus or a node in this cycle, if any.
    fn lost(&mut self, now_ns: i64) -> Option<String> {
        if self.is_bus_off {
            return Some(
                self.on("the adapter has left the bus (bus off): check the cables, the terminating resistors and the bit rate; then reset the device"),
            );
        }
        for station in &mut self.stations {
            let answers = station.answers();
            if self.has_asked && answers && !std::mem::take(&mut station.heard.is_fresh) {
                station.heard.cycles += 1;
                self.counters.add(Count::Lost, 1);
            }
            let (missing, beats) = station.heard.missing(now_ns, self.terms.heartbeat_ns, self.lost_after);
            self.counters.add(Count::Missed, beats);
            let what = match missing {
                None => continue,
                Some(Missing::Left(NodeState::BootUp)) => "has restarted: it lost its power, or was reset".to_owned(),
                Some(Missing::Left(state)) => format!("has left operation: it is {state}"),
                Some(Missing::Cycles) => format!("sent no process data for {} cycles: its cable is unplugged, or it has no power", station.heard.cycles),
                Some(Missing::Beats) => "missed its heartbeat: its cable is unplugged, or it has no power".to_owned(),
            };
            return Some(format!("{} {what}", station.title()));
        }
        None
    }
}

impl Driver for CanOpen {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        self.start().map_err(|message| {
            self.link = None;
            DeviceError { message }
        })
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let Some(link) = &mut self.link else { return Err(not_open()) };
        let came = link.settle(release_ns).and_then(|()| self.receive(release_ns));
        came.map_err(|error| DeviceError { message: self.on(error) })?;
        let late = self.written_ns.is_some_and(|written| release_ns - written > self.terms.timeout_ns);
        if late && self.stations.iter().any(|station| station.is_watched) {
            return Err(DeviceError {
                message: format!("its nodes stopped by themselves: no command arrived within their timeout of {} ms", self.terms.timeout_ns as f64 * 1e-6),
            });
        }
        if let Some(message) = self.lost(release_ns) {
            self.beside.shared.homes.end();
            return Err(DeviceError { message });
        }
        self.has_asked = false;
        for station in &self.stations {
            station.show(readings);
        }
        match self.stations.iter().find_map(Station::fault) {
            Some(message) => Err(DeviceError { message }),
            None => Ok(()),
        }
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        if self.link.is_none() {
            return Err(not_open());
        }
        let span_s = (release_ns - self.written_ns.unwrap_or(release_ns)).max(0) as f64 * 1e-9;
        self.written_ns = Some(release_ns);
        for (index, station) in self.stations.iter_mut().enumerate() {
            let can_home = station.can_home();
            match &mut station.what {
                // Each axis has one written channel, and these precede those of the modules.
                What::Axis(axis) => {
                    let (commander, is_engaged) = (&mut axis.moved.commander, engaged[index]);
                    if self.beside.shared.resets(index) {
                        commander.reset();
                    }
                    self.beside.shared.homes.serve(index, commander, can_home, is_engaged);
                    axis.tell(commands, is_engaged, span_s);
                }
                What::Module(module) => module.tell(commands),
            }
        }
        self.send_told();
        // A drive receives the heartbeat four times within its timeout, and never without a running source.
        if self.beaten_ns.is_none_or(|beaten| release_ns - beaten >= self.terms.timeout_ns / 4 || release_ns < beaten) {
            self.beaten_ns = Some(release_ns);
            self.send(&nmt::heartbeat(self.terms.own_node, NodeState::Operational));
        }
        self.send(&nmt::sync());
        self.counters.add(Count::Cycles, 1);
        self.has_asked = true;
        Ok(())
    }

    fn safe_state(&mut self) {
        self.beside.shared.homes.rest();
        self.stations.iter_mut().for_each(Station::stop);
        if self.link.is_some() {
            self.send_idle();
        }
    }

    fn close(&mut self) {
        self.safe_state();
        self.link = None;
        self.beside.shared.leave();
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let Some(descriptor) = self.link.as_ref().and_then(|link| link.duplicate()) else { return Vec::new() };
        let frames = self.stations.iter().flat_map(|station| station.last_frames().into_iter().flatten()).chain([nmt::sync()]);
        vec![SafeHandle { descriptor, writes: frames.map(|frame| (0, frame.encoded().to_vec())).collect(), latches: false }]
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.stations.iter().any(|station| station.is_watched).then_some(self.terms.timeout_ns)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.beside.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}

fn not_open() -> DeviceError {
    DeviceError { message: "the bus is not open".to_owned() }
}
