// SPDX-License-Identifier: Apache-2.0
//! The driver in its life: brings its drives to operation, exchanges, comes to rest.
use super::axis::Axis;
use super::bring_up::{Terms, configure};
use super::counters::{self as count, COUNTERS};
use super::heard::{Heard, Missing};
use super::options::Options;
use super::services::Shared;
use crate::client::Client;
use crate::frame::{self, Came, Frame};
use crate::link::{Link, Place};
use crate::message::{self, Message};
use crate::nmt::{self, Command, NODE_MAX, NodeState};
use device::{Channel, Counters, DeviceError, Driver, SafeHandle, Services};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// What the cycle hears: emergencies, process data, heartbeats.
const HEARD: [(u16, u16); 4] = [(0x080, 0x780), (0x180, 0x780), (0x280, 0x780), (0x700, 0x780)];
/// Frames that a cycle takes at most: the rest is for the next.
const TAKEN_MAX: usize = 1024;
/// How long drives may take to send their first process data, and one cycle off the clock.
const TO_OPERATION: Duration = Duration::from_secs(5);
const ANSWER: Duration = Duration::from_millis(100);
/// An object, from a node that may be busy with its storage.
pub const OBJECT: Duration = Duration::from_secs(1);

pub struct CanOpen {
    place: Place,
    axes: Vec<Axis>,
    heard: Vec<Heard>,
    /// The axis of each node.
    by_node: [Option<u8>; NODE_MAX as usize + 1],
    channels: Vec<Channel>,
    terms: Terms,
    lost_after: u32,
    counters: Arc<Counters>,
    shared: Arc<Shared>,
    link: Option<Box<dyn Link>>,
    /// A SYNC was sent since the last reading.
    has_asked: bool,
    is_bus_off: bool,
    written_ns: Option<i64>,
    beaten_ns: Option<i64>,
}

impl CanOpen {
    pub fn new(options: &Options, place: Place, axes: Vec<Axis>, channels: Vec<Channel>) -> CanOpen {
        let mut by_node = [None; NODE_MAX as usize + 1];
        for (index, axis) in axes.iter().enumerate() {
            by_node[usize::from(axis.node & NODE_MAX)] = Some(index as u8);
        }
        let names = axes.iter().map(|axis| (axis.name.clone(), axis.node)).collect();
        CanOpen {
            shared: Arc::new(Shared::new(place.clone(), names)),
            place,
            heard: axes.iter().map(|_| Heard::default()).collect(),
            axes,
            by_node,
            channels,
            terms: Terms { own_node: options.own_node, timeout_ns: options.timeout_ns, heartbeat_ns: options.heartbeat_ns, cycle_ns: options.cycle_ns },
            lost_after: options.lost_after,
            counters: Arc::new(Counters::new(&COUNTERS)),
            link: None,
            has_asked: false,
            is_bus_off: false,
            written_ns: None,
            beaten_ns: None,
        }
    }

    fn on(&self, error: impl std::fmt::Display) -> String {
        format!("interface '{}': {error}", self.place)
    }

    fn start(&mut self) -> Result<(), String> {
        self.link = None;
        let mut client = Client::open(&self.place, OBJECT).map_err(|error| self.on(error))?;
        for axis in &mut self.axes {
            axis.inputs = crate::pdo::inputs();
            configure(&mut client, axis, &self.terms)?;
        }
        self.link = Some(self.place.open(&HEARD).map_err(|error| self.on(error))?);
        self.heard.iter_mut().for_each(Heard::expect);
        for node in self.axes.iter().map(|axis| axis.node) {
            client.send(&Command::Start.frame(node)).map_err(|error| error.to_string())?;
        }
        (self.is_bus_off, self.written_ns, self.beaten_ns) = (false, None, None);
        self.exchange_idle()?;
        self.reset_faults()?;
        // What was said of them before they were started is old.
        self.heard.iter_mut().for_each(Heard::expect);
        self.has_asked = false;
        self.shared.reach(client);
        Ok(())
    }

    /// A cycle with no axis commanded, off the clock; again until all drives have sent their process data.
    fn exchange_idle(&mut self) -> Result<(), String> {
        let end = Instant::now() + TO_OPERATION;
        loop {
            self.heard.iter_mut().for_each(|heard| heard.is_fresh = false);
            self.send_idle();
            let until = Instant::now() + ANSWER;
            loop {
                self.receive(0).map_err(|error| self.on(error))?;
                let Some(silent) = self.heard.iter().position(|heard| !heard.is_fresh) else { return Ok(()) };
                if Instant::now() > end {
                    let Axis { name, node, .. } = &self.axes[silent];
                    return Err(format!("node {node} (axis '{name}') sends no process data within {} s of its start", TO_OPERATION.as_secs()));
                }
                if Instant::now() > until {
                    break;
                }
                self.link.iter_mut().for_each(|link| link.wait(ANSWER));
            }
        }
    }

    /// Faults that are there already go; one that comes again is told when its axis is engaged.
    fn reset_faults(&mut self) -> Result<(), String> {
        for _ in 0..4 {
            self.axes.iter_mut().filter(|axis| axis.commander.is_faulty()).for_each(|axis| axis.commander.reset());
            self.exchange_idle()?;
        }
        self.exchange_idle()
    }

    /// Takes all that came.
    fn receive(&mut self, now_ns: i64) -> std::io::Result<()> {
        for _ in 0..TAKEN_MAX {
            let Some(link) = &mut self.link else { return Ok(()) };
            match link.receive()? {
                None => break,
                Some(Came::Frame(frame)) => self.take(&frame, now_ns),
                Some(Came::Report { classes, controller }) => self.note(classes, controller),
                Some(Came::Strange) => self.counters.add(count::REFUSED, 1),
            }
        }
        let overflowed = self.link.as_ref().map_or(0, |link| link.overflowed());
        self.counters.set(count::OVERFLOWED, u64::from(overflowed));
        Ok(())
    }

    fn take(&mut self, frame: &Frame, now_ns: i64) {
        // Other nodes of the bus are nobody's here.
        let Some(axis) = self.by_node[usize::from(frame.id & 0x7F)] else { return };
        let (axis, heard) = (&mut self.axes[usize::from(axis)], &mut self.heard[usize::from(axis)]);
        match message::read(frame) {
            Some(Message::Pdo { number: number @ (1 | 2), bytes, .. }) if axis.take(number, bytes) => {
                if number == 1 {
                    heard.fresh(now_ns);
                }
            }
            Some(Message::Heartbeat { state, .. }) => heard.heartbeat(now_ns, state),
            Some(Message::Emergency { code, .. }) => {
                heard.data(now_ns);
                axis.heed(code);
                self.counters.add(count::EMERGENCIES, 1);
            }
            _ => self.counters.add(count::REFUSED, 1),
        }
    }

    /// What the adapter says about the bus.
    fn note(&mut self, classes: u32, controller: u8) {
        if classes & frame::BUS_OFF != 0 {
            self.is_bus_off = true;
            self.counters.add(count::BUS_OFF, 1);
        }
        if classes & frame::RESTARTED != 0 {
            self.is_bus_off = false;
        }
        if classes & frame::CONTROLLER != 0 && controller & frame::PASSIVE != 0 {
            self.counters.add(count::PASSIVE, 1);
        }
    }

    fn send(&mut self, frame: &Frame) {
        let sent = self.link.as_mut().is_some_and(|link| link.send(frame).is_ok());
        // What is not sent brings no process data back: the readings tell it.
        self.counters.add(count::UNSENT, u64::from(!sent));
    }

    fn send_idle(&mut self) {
        for index in 0..self.axes.len() {
            let frame = self.axes[index].told_idle();
            self.send(&frame);
        }
        self.send(&nmt::sync());
    }

    /// What is wrong with the bus or a node, at this cycle.
    fn lost(&mut self, now_ns: i64) -> Option<String> {
        if self.is_bus_off {
            return Some(
                self.on("the adapter has left the bus (bus off): look at the cables, the terminating resistors and the bit rate; then reset the device"),
            );
        }
        for (axis, heard) in self.axes.iter().zip(&mut self.heard) {
            if self.has_asked && !std::mem::take(&mut heard.is_fresh) {
                heard.cycles += 1;
                self.counters.add(count::LOST, 1);
            }
            let (missing, beats) = heard.missing(now_ns, self.terms.heartbeat_ns, self.lost_after);
            self.counters.add(count::MISSED, beats);
            let (name, node) = (&axis.name, axis.node);
            let what = match missing {
                None => continue,
                Some(Missing::Left(NodeState::BootUp)) => "has started anew: it was without power, or was reset".to_owned(),
                Some(Missing::Left(state)) => format!("has left operation: it is {state}"),
                Some(Missing::Cycles) => format!("sends no process data for {} cycles: its cable is out, or it has no power", heard.cycles),
                Some(Missing::Beats) => "has missed its heartbeat: its cable is out, or it has no power".to_owned(),
            };
            return Some(format!("node {node} (axis '{name}') {what}"));
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
        if late && self.axes.iter().any(|axis| axis.is_watched) {
            return Err(DeviceError {
                message: format!("its drives have stopped by themselves: no command came for their timeout of {} ms", self.terms.timeout_ns as f64 * 1e-6),
            });
        }
        if let Some(message) = self.lost(release_ns) {
            return Err(DeviceError { message });
        }
        self.has_asked = false;
        for axis in &self.axes {
            axis.show(readings);
        }
        match self.axes.iter().find_map(Axis::fault) {
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
        for (index, engaged) in engaged.iter().enumerate().take(self.axes.len()) {
            if self.shared.resets[index].swap(false, Ordering::Relaxed) {
                self.axes[index].commander.reset();
            }
            let frame = self.axes[index].told(commands, *engaged, span_s);
            self.send(&frame);
        }
        // A drive hears it four times before its patience ends, and never without a source that goes on.
        if self.beaten_ns.is_none_or(|beaten| release_ns - beaten >= self.terms.timeout_ns / 4 || release_ns < beaten) {
            self.beaten_ns = Some(release_ns);
            self.send(&nmt::heartbeat(self.terms.own_node, NodeState::Operational));
        }
        self.send(&nmt::sync());
        self.counters.add(count::CYCLES, 1);
        self.has_asked = true;
        Ok(())
    }

    fn safe_state(&mut self) {
        self.axes.iter_mut().for_each(|axis| axis.commander.stop());
        if self.link.is_some() {
            self.send_idle();
        }
    }

    fn close(&mut self) {
        self.safe_state();
        self.link = None;
        self.shared.leave();
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let Some(descriptor) = self.link.as_ref().and_then(|link| link.duplicate()) else { return Vec::new() };
        let frames = self.axes.iter().map(Axis::last_word).chain([nmt::sync()]);
        vec![SafeHandle { descriptor, writes: frames.map(|frame| (0, frame.encoded().to_vec())).collect(), latches: false }]
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.axes.iter().any(|axis| axis.is_watched).then_some(self.terms.timeout_ns)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.shared.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}

fn not_open() -> DeviceError {
    DeviceError { message: "the bus is not open".to_owned() }
}
