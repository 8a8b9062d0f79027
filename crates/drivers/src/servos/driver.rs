// SPDX-License-Identifier: Apache-2.0
//! Exchange with the servos on a bus: one request reads all servos, and all goals are sent in one frame.
use super::bus::Timing;
use super::bus::{Bus, Count, ServoAnswer};
use super::frame::Frame;
use super::options::{ServoBusOptions, WiredJoint};
use super::protocol::Protocol;
use super::registers::{Effort, Map, Present, Register, WATCHDOG_UNIT_NS};
use super::services::Desk;
use device::{Channel, Command, Counters, DeviceError, Driver, Layout, OpenedDriver, Part, SafeHandle, Services, Servo, Slot, Type, UNLIMITED};
use serde_json::json;
use std::sync::Arc;

/// Distance from the command above which a goal counts as held back, rad.
const NEAR: f64 = 1e-3;
/// Maximum time, s, counted for the motion of the next goal, however long ago the last goal was written.
const SPAN_MAX: f64 = 0.1;

pub(super) struct Servos {
    pub(super) map: &'static Map,
    pub(super) protocol: Protocol,
    pub(super) port: String,
    pub(super) timing: Timing,
    max_speed: f64,
    /// Timeout of the servos' own watchdog, in their units.
    pub(super) watchdog: Option<u8>,
    /// Index of the joint that was checked last.
    pub(super) looked: usize,
    channels: Vec<Channel>,
    pub(super) joints: Vec<Joint>,
    pub(super) bus: Option<Bus>,
    pub(super) desk: Arc<Desk>,
    pub(super) counters: Arc<Counters>,
    ids: Vec<u8>,
    done: Vec<bool>,
    /// Scratch buffer for the rows of a frame for several servos.
    pub(super) rows: Vec<u8>,
    written_ns: Option<i64>,
    /// CPU time of the latest write, ns.
    write_ns: u64,
}

/// Current state of a joint.
pub(super) struct Joint {
    pub(super) wired: WiredJoint,
    slots: Slots,
    pub(super) present: Present,
    /// Error reported in the servo's latest answer.
    error: u8,
    pub(super) has_torque: bool,
    /// Last goal sent, rad.
    pub(super) goal: f64,
    /// Zero recorded for the next calibration, counts.
    pub(super) zero: Option<f64>,
    pub(super) ends: Option<(f64, f64)>,
    /// Counts at the previous reading, while range ends are being recorded.
    pub(super) last: f64,
    /// Counts before and after the wrap-around of the joint's encoder, if the joint was moved across it while range ends were being
    /// recorded.
    pub(super) seam: Option<(f64, f64)>,
}

/// Slots of one joint.
struct Slots {
    position: Slot,
    velocity: Slot,
    load: Option<Slot>,
    current: Option<(Slot, f64)>,
    voltage: Slot,
    temperature: Slot,
    status: Slot,
    goal: Slot,
}

impl Servos {
    pub(super) fn made(wanted: ServoBusOptions, protocol: Protocol) -> OpenedDriver {
        let mut layout = Layout::default();
        let joints: Vec<Joint> = wanted.joints.into_iter().map(|wired| Joint::new(wired, &mut layout)).collect();
        let parts: Vec<Part> = joints.iter().map(|joint| joint.part(wanted.max_speed)).collect();
        let driver = Servos {
            map: Map::of(protocol),
            protocol,
            port: wanted.port,
            timing: wanted.timing,
            max_speed: wanted.max_speed,
            watchdog: wanted.watchdog,
            looked: 0,
            channels: layout.into_channels(),
            ids: joints.iter().map(|joint| joint.wired.id).collect(),
            done: vec![false; joints.len()],
            rows: Vec::with_capacity(8 * joints.len()),
            joints,
            bus: None,
            desk: Arc::default(),
            counters: Arc::new(Counters::new(Count::WORDS)),
            written_ns: None,
            write_ns: 0,
        };
        (Box::new(driver), json!({ "parts": parts }))
    }

    /// Creates an error about a joint.
    pub(super) fn wrong(&self, joint: usize, what: &str) -> DeviceError {
        let WiredJoint { name, id, .. } = &self.joints[joint].wired;
        DeviceError { message: format!("servo '{name}' (id {id}) on {} {what}", self.port) }
    }

    /// Returns the error for a failure of the line.
    pub(super) fn gone(&self, why: &std::io::Error) -> DeviceError {
        DeviceError { message: format!("{}: {why}; plug its adapter in again, then reset() and enable()", self.port) }
    }

    pub(super) fn line(&mut self) -> Result<&mut Bus, DeviceError> {
        self.bus.as_mut().ok_or_else(|| DeviceError { message: "it is not open".to_owned() })
    }

    /// Reads all servos, and repeats the request for those that have not answered.
    fn exchange(&mut self) -> Result<(), DeviceError> {
        let Servos { bus: Some(bus), joints, protocol, map, ids, done, .. } = self else { return self.line().map(|_| ()) };
        let mut refused = None;
        let read = bus.sync_read(map.present, ids, done, &mut |index, answer| match protocol.present(answer.bytes) {
            Some(present) => (joints[index].present, joints[index].error) = (present, answer.error | present.error),
            None => refused = Some((index, answer.error)),
        });
        read.map_err(|why| self.gone(&why))?;
        if let Some(silent) = self.done.iter().position(|done| !done) {
            let tries = self.timing.retries + 1;
            return Err(self.wrong(silent, &format!("does not answer ({tries} requests); check its power and its cable")));
        }
        if let Some((index, error)) = refused {
            return Err(self.wrong(index, &format!("refuses the read request: error {error}")));
        }
        self.counters.add(Count::Exchanges, 1);
        self.look_at_watchdog()?;
        (0..self.joints.len()).try_for_each(|joint| self.heed(joint))
    }

    /// Checks the error reported by a servo; fails if it is critical.
    fn heed(&mut self, joint: usize) -> Result<(), DeviceError> {
        if self.joints[joint].error == 0 {
            return Ok(());
        }
        self.counters.add(Count::Alerts, 1);
        if self.protocol == Protocol::Dynamixel {
            // The answer only indicates that there is an error.
            let error = self.ask(joint, self.map.error)?.value;
            self.joints[joint].error = error as u8;
        }
        let Joint { error, present, .. } = &self.joints[joint];
        if error & self.map.grave == 0 {
            return Ok(());
        }
        let (volts, celsius) = (present.voltage, present.temperature - 273.15);
        let what = format!("reports {} at {volts:.1} V and {celsius:.0} °C; free it, let it cool, then reset()", self.map.named(*error));
        Err(self.wrong(joint, &what))
    }

    /// Returns the value of a register.
    pub(super) fn ask(&mut self, joint: usize, register: Register) -> Result<ServoAnswer, DeviceError> {
        let id = self.joints[joint].wired.id;
        let read = self.line()?.read(id, register).map_err(|why| self.gone(&why))?;
        read.ok_or_else(|| {
            self.wrong(
                joint,
                &format!("does not answer at {} baud; check its power and cable, or run a scan, which finds ids and baud rates", self.timing.baud),
            )
        })
    }

    fn show(&self, readings: &mut [u8]) {
        for Joint { wired, slots, present, error, .. } in &self.joints {
            slots.position.set_double(readings, 0, wired.angle(present.counts));
            slots.velocity.set_double(readings, 0, wired.direction * present.velocity);
            if let Some(load) = slots.load {
                load.set_double(readings, 0, wired.direction * present.load);
            }
            if let Some((current, amperes)) = slots.current {
                current.set_double(readings, 0, wired.direction * present.current * amperes);
            }
            slots.voltage.set_double(readings, 0, present.voltage);
            slots.temperature.set_double(readings, 0, present.temperature);
            slots.status.of_mut(readings).copy_from_slice(&[*error]);
        }
    }

    /// Switches torque on for claimed joints, and off for all others.
    fn arm(&mut self, engaged: &[bool]) -> Result<(), DeviceError> {
        for (joint, engaged) in engaged.iter().enumerate() {
            match (engaged, self.joints[joint].has_torque) {
                (true, false) => self.hold(joint)?,
                (false, true) => self.release(joint)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Sends the goals of the joints with torque on, none farther from the previous goal than the maximum speed allows.
    fn goals(&mut self, span_s: f64, commands: &[u8]) -> Result<(), DeviceError> {
        self.rows.clear();
        let step = self.max_speed * span_s;
        for joint in self.joints.iter_mut().filter(|joint| joint.has_torque) {
            let commanded = joint.slots.goal.double(commands, 0);
            let wanted = if commanded.is_finite() { commanded.clamp(joint.wired.min, joint.wired.max) } else { joint.goal };
            joint.goal = wanted.clamp(joint.goal - step, joint.goal + step);
            let is_limited = commanded.is_finite() && (joint.goal - commanded).abs() > NEAR;
            self.counters.add(Count::GoalsLimited, u64::from(is_limited));
            self.rows.push(joint.wired.id);
            self.rows.extend_from_slice(&self.protocol.goal(joint.wired.counts(joint.goal))[..usize::from(self.map.goal.len)]);
        }
        if self.rows.is_empty() {
            return Ok(());
        }
        let Servos { bus: Some(bus), map, rows, .. } = self else { return Ok(()) };
        bus.sync_write(map.goal, rows).map_err(|why| self.gone(&why))
    }
}

impl Driver for Servos {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, _: i64) -> Result<(), DeviceError> {
        let opened = Bus::open(&self.port, self.protocol, self.timing, self.counters.clone());
        self.bus = Some(opened.map_err(|why| DeviceError { message: format!("the serial line {} cannot be opened: {why}", self.port) })?);
        self.meet()
    }

    fn read(&mut self, _: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.serve();
        let began_ns = processor_ns();
        self.exchange()?;
        self.record();
        self.show(readings);
        self.counters.set(Count::HostTime, processor_ns().saturating_sub(began_ns) + std::mem::take(&mut self.write_ns));
        Ok(())
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        let began_ns = processor_ns();
        self.arm(engaged)?;
        let span_s = self.written_ns.map_or(0.0, |written_ns| (release_ns - written_ns) as f64 * 1e-9);
        self.written_ns = Some(release_ns);
        self.goals(span_s.clamp(0.0, SPAN_MAX), commands)?;
        self.write_ns = processor_ns().saturating_sub(began_ns);
        Ok(())
    }

    fn safe_state(&mut self) {
        self.rest();
        self.written_ns = None;
    }

    fn close(&mut self) {
        if self.joints.iter().any(|joint| joint.has_torque) {
            self.rest();
        }
        self.bus = None;
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        let rows: Vec<u8> = self.ids.iter().flat_map(|id| [*id, 0]).collect();
        let mut frame = Frame::new();
        let descriptor = self.bus.as_ref().and_then(|bus| bus.descriptor().ok());
        match descriptor {
            // A partial transmission by this process may swallow the first frame.
            Some(descriptor) if self.relax(&mut frame, &rows) => {
                vec![SafeHandle { descriptor, writes: vec![(0, frame.bytes().to_vec()); 3], latches: false }]
            }
            _ => Vec::new(),
        }
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.watchdog.map(|units| i64::from(units) * WATCHDOG_UNIT_NS)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.desk.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}

impl Joint {
    fn new(wired: WiredJoint, layout: &mut Layout) -> Joint {
        let name = wired.name.clone();
        let mut read = |word: &str, unit: &str, doc: &str| layout.add(Channel::read(format!("{name}.{word}"), Type::DOUBLE).unit(unit).doc(doc));
        let position = read("position", "rad", "position from its zero");
        let velocity = read("velocity", "rad/s", "velocity");
        let has_load = matches!(wired.model.effort, Effort::Load | Effort::Both(_));
        let load = has_load.then(|| read("load", "1", "share of its maximum effort"));
        let current = match wired.model.effort {
            Effort::Current(amperes) | Effort::Both(amperes) => Some((read("current", "A", "temperature of its motor"), amperes)),
            Effort::Load => None,
        };
        let (voltage, temperature) = (read("voltage", "V", "voltage of its supply"), read("temperature", "K", "temperature inside it"));
        let status = layout.add(Channel::read(format!("{name}.status"), Type::of(device::Number::Uint8)).doc("its error bits; 0: no error"));
        let goal = Channel::write(format!("{name}.goal"), Type::DOUBLE).unit("rad").doc("goal position; its torque is on while a verb claims it");
        // The safe value is no goal: the joint stays where it is until one is stored.
        let goal = layout.add(goal.safe(f64::NAN.to_ne_bytes().to_vec()));
        let slots = Slots { position, velocity, load, current, voltage, temperature, status, goal };
        Joint { wired, slots, present: Present::default(), error: 0, has_torque: false, goal: 0.0, zero: None, ends: None, last: 0.0, seam: None }
    }

    fn part(&self, max_speed: f64) -> Part {
        let WiredJoint { name, min, max, .. } = &self.wired;
        Part {
            name: name.clone(),
            command: Command::Position,
            unit: "rad",
            range_min: *min,
            range_max: *max,
            effort_max: UNLIMITED,
            speed_max: max_speed,
            home: 0f64.clamp(*min, *max),
            servo: Servo::default(),
        }
    }
}

/// Returns the CPU time of this thread, ns.
fn processor_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the argument is one `timespec` that is alive.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}
