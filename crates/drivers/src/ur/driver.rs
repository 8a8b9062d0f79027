// SPDX-License-Identifier: Apache-2.0
//! Exchange with the controller: takes the newest package received, and sends one in return.
use super::dashboard::Panel;
use super::link::LinkError;
use super::options::Options;
use super::sample::JOINTS;
use super::script::CYCLE_NS;
use super::session::Session;
use super::states::{hindrance, interruption};
use device::{Channel, Command, Counters, DeviceError, Driver, Layout, Part, Services, Servo, Slot, Type, UNLIMITED};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

const NAMES: [&str; JOINTS] = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];
const HOME: [f64; JOINTS] = [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, 0.0, 0.0];
/// Number of digital inputs, and of digital outputs, of the control box.
const DIGITAL: usize = 8;
/// Maximum time counted for the motion of a late goal, ns.
const SPAN_NS_MAX: i64 = 2 * CYCLE_NS;

device::counters! {
    /// Counters of the driver.
    pub(super) enum Count {
        Packages: "packages", "", "packages received, each the newest at its time";
        Refused: "packages_refused", "", "packages that differed from the agreed form, or contained a value that is not a number";
        Unsent: "packages_unsent", "", "packages not sent because the connection had not accepted the previous one";
        Limited: "goals_limited", "", "goals limited because they were farther from the previous one than the maximum speed allows";
        Age: "age", "ns", "age of the newest package, in firings";
    }
}

/// Slots of the values.
struct Slots {
    position: [Slot; JOINTS],
    velocity: [Slot; JOINTS],
    force: Slot,
    torque: Slot,
    speed_scaling: Slot,
    inputs: [Slot; DIGITAL],
    analog: [Slot; 2],
    goals: [Slot; JOINTS],
    outputs: [Slot; DIGITAL],
}

pub(super) struct Ur {
    options: Options,
    address: IpAddr,
    channels: Vec<Channel>,
    slots: Slots,
    counters: Arc<Counters>,
    panel: Arc<Panel>,
    session: Option<Session>,
    /// True if nothing has been read since opening.
    is_new: bool,
    /// True if a package has been received for which no package has been sent yet.
    fresh: bool,
    /// Release time of the firing that took the newest package, ns.
    taken_ns: i64,
    /// Release time of the firing that sent the newest package, ns.
    sent_ns: i64,
    /// Bit mask of the digital outputs that have been commanded at any time.
    commanded: u8,
}

impl Ur {
    pub fn new(options: Options, address: IpAddr) -> (Ur, Vec<Part>) {
        let part = |(i, name): (usize, &&str)| Part {
            name: (*name).to_owned(),
            unit: "rad",
            range_min: if i == 2 { -PI } else { -TAU },
            range_max: if i == 2 { PI } else { TAU },
            effort_max: UNLIMITED,
            speed_max: options.speed_max,
            home: HOME[i],
            servo: Servo::default(),
            command: Command::Position,
        };
        let parts = NAMES.iter().enumerate().map(part).collect();
        let (channels, slots) = channels();
        let panel = Arc::new(Panel { to: SocketAddr::new(address, options.dashboard_port) });
        let counters = Arc::new(Counters::new(Count::WORDS));
        (Ur { options, address, channels, slots, counters, panel, session: None, is_new: false, fresh: false, taken_ns: 0, sent_ns: 0, commanded: 0 }, parts)
    }

    /// Sends the next goals, no farther from the previous ones than the maximum speed allows. The arm is at rest if no joint is
    /// commanded.
    fn tell(&mut self, span_ns: i64, commands: &[u8], engaged: &[bool]) {
        let Some(session) = &mut self.session else { return };
        let goal = |i: usize| Some(self.slots.goals[i].double(commands, 0)).filter(|goal| engaged[i] && goal.is_finite());
        if (0..JOINTS).all(|i| goal(i).is_none()) {
            session.rest();
        } else {
            if session.told.mode != session.number {
                session.rest();
            }
            session.told.mode = session.number;
            let most = self.options.speed_max * span_ns.clamp(CYCLE_NS, SPAN_NS_MAX) as f64 * 1e-9;
            for (i, held) in session.told.goals.iter_mut().enumerate() {
                let Some(wanted) = goal(i) else { continue };
                let given = wanted.clamp(*held - most, *held + most);
                self.counters.add(Count::Limited, u64::from(given != wanted));
                *held = given;
            }
        }
        (session.told.mask, session.told.levels) = (0, 0);
        for (i, slot) in self.slots.outputs.iter().enumerate().filter(|(i, _)| engaged[JOINTS + i]) {
            session.told.mask |= 1 << i;
            session.told.levels |= u8::from(slot.of(commands)[0] != 0) << i;
        }
        self.commanded |= session.told.mask;
    }

    fn store(&self, readings: &mut [u8]) {
        let Some(Session { sample, .. }) = &self.session else { return };
        let slots = &self.slots;
        for i in 0..JOINTS {
            slots.position[i].set_double(readings, 0, sample.position[i]);
            slots.velocity[i].set_double(readings, 0, sample.velocity[i]);
        }
        for i in 0..3 {
            slots.force.set_double(readings, i, sample.force[i]);
            slots.torque.set_double(readings, i, sample.force[3 + i]);
        }
        slots.speed_scaling.set_double(readings, 0, sample.speed_scaling);
        for (i, slot) in slots.inputs.iter().enumerate() {
            slot.of_mut(readings)[0] = u8::from(sample.inputs >> i & 1 == 1);
        }
        for (slot, volts) in slots.analog.iter().zip(sample.analog) {
            slot.set_double(readings, 0, volts);
        }
    }
}

fn channels() -> (Vec<Channel>, Slots) {
    let mut layout = Layout::default();
    let read = |name: String, of: Type, unit: &str, doc: &str| Channel::read(name, of).unit(unit).doc(doc);
    let position = NAMES.map(|name| layout.add(read(format!("{name}.position"), Type::DOUBLE, "rad", "joint position")));
    let velocity = NAMES.map(|name| layout.add(read(format!("{name}.velocity"), Type::DOUBLE, "rad/s", "joint velocity")));
    let force = layout.add(read("tool.force".to_owned(), Type::doubles(3), "N", "force at the tool, in the frame of the base"));
    let torque = layout.add(read("tool.torque".to_owned(), Type::doubles(3), "N.m", "torque at the tool, in the frame of the base"));
    let speed_scaling = layout.add(read("speed_scaling".to_owned(), Type::DOUBLE, "", "speed fraction to which the controller slows programs down, 0 to 1"));
    let inputs = std::array::from_fn(|i| layout.add(read(format!("io.in{i}"), Type::BOOL, "", "digital input of the control box")));
    let analog =
        std::array::from_fn(|i| layout.add(read(format!("io.analog_in{i}"), Type::DOUBLE, "", "analog input of the control box, V or A as configured")));
    let hold = f64::NAN.to_ne_bytes();
    let goals = NAMES.map(|name| {
        let goal = Channel::write(format!("{name}.goal"), Type::DOUBLE).unit("rad");
        layout.add(goal.doc("goal position of the joint; NaN: it stays").safe(hold.to_vec()))
    });
    let outputs = std::array::from_fn(|i| {
        let output = Channel::write(format!("io.out{i}"), Type::BOOL);
        layout.add(output.doc("digital output of the control box; as set on the pendant while it is not commanded"))
    });
    (layout.into_channels(), Slots { position, velocity, force, torque, speed_scaling, inputs, analog, goals, outputs })
}

fn lost(why: impl ToString) -> DeviceError {
    DeviceError { message: why.to_string() }
}

impl Driver for Ur {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.session = Some(Session::begin(&self.options, self.address)?);
        (self.is_new, self.fresh, self.taken_ns, self.sent_ns) = (true, true, now_ns, now_ns);
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let Some(session) = &mut self.session else { return Err(lost("it is not open")) };
        if std::mem::take(&mut self.is_new) && !self.options.lockstep {
            // The opening may have waited for a booting controller: that does not count as silence.
            (self.taken_ns, self.sent_ns) = (release_ns, release_ns);
        }
        let is_due = self.options.lockstep && !self.fresh && release_ns - self.taken_ns >= CYCLE_NS;
        let taken = if is_due { session.wait(session.answer) } else { session.take() };
        self.counters.set(Count::Refused, session.refused);
        if taken.map_err(lost)? {
            (self.fresh, self.taken_ns) = (true, release_ns);
            self.counters.add(Count::Packages, 1);
        } else if is_due {
            return Err(lost("the controller no longer sends anything"));
        }
        let age_ns = release_ns - self.taken_ns;
        self.counters.set(Count::Age, age_ns.unsigned_abs());
        if !self.options.lockstep && age_ns > self.options.silence_ns {
            return Err(lost(format!("nothing has been received from the controller for {} ms: its cable is unplugged, or it is off", age_ns / 1_000_000)));
        }
        if let Some(why) = hindrance(&session.sample).or_else(|| interruption(&session.sample, session.number)) {
            return Err(lost(why));
        }
        self.store(readings);
        Ok(())
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        if !std::mem::take(&mut self.fresh) {
            return Ok(());
        }
        self.tell(release_ns - self.sent_ns, commands, engaged);
        self.sent_ns = release_ns;
        let sent = self.session.as_mut().map_or(Ok(true), Session::send);
        self.counters.add(Count::Unsent, u64::from(!sent.map_err(lost)?));
        Ok(())
    }

    fn safe_state(&mut self) {
        if let Some(session) = &mut self.session {
            session.rest();
            (session.told.mask, session.told.levels) = (self.commanded, 0);
            // If the package does not arrive, the program on the controller misses it and stops the arm by itself.
            let _: Result<bool, LinkError> = session.send();
        }
    }

    fn close(&mut self) {
        if let Some(mut session) = self.session.take() {
            session.rest();
            (session.told.mode, session.told.mask, session.told.levels) = (-1, self.commanded, 0);
            // As above.
            let _: Result<bool, LinkError> = session.send();
        }
    }

    fn watchdog_ns(&self) -> Option<i64> {
        Some(self.options.timeout_ns)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.panel.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}
