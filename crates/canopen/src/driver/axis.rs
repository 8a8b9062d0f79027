// SPDX-License-Identifier: Apache-2.0
//! An axis: its channels, and the process data of its drive.
use super::options::{AxisOptions, Commanded, Unit};
use crate::frame::Frame;
use crate::message::emergency_name;
use crate::pdo::{self, Pdo};
use cia402::{Commander, Mode, Scale};
use device::{Channel, Command, Layout, Number, Part, Servo, Slot, Type, UNLIMITED};

/// An axis, and what it is doing.
pub struct Axis {
    pub name: String,
    pub node: u8,
    pub scale: Scale,
    pub is_watched: bool,
    pub commander: Commander,
    /// What its drive sends.
    pub inputs: [Pdo; 2],
    slots: Slots,
    velocity: i32,
    torque: i32,
    /// Its error code, and that of its latest emergency.
    error: u16,
    emergency: u16,
    status: u16,
}

struct Slots {
    position: Slot,
    velocity: Slot,
    torque: Slot,
    bias: Option<Slot>,
    status: Slot,
    error: Slot,
    command: Slot,
}

impl Axis {
    pub fn new(options: &AxisOptions, layout: &mut Layout) -> Axis {
        let scale = options.scale();
        Axis {
            name: options.name.clone(),
            node: options.node,
            scale,
            is_watched: options.is_watched(),
            commander: Commander::new(scale),
            inputs: pdo::inputs(),
            slots: Slots::new(options, layout),
            velocity: 0,
            torque: 0,
            error: 0,
            emergency: 0,
            status: 0,
        }
    }

    /// Takes a PDO of its drive; false: it has not the length that was configured.
    pub fn take(&mut self, number: u8, bytes: &[u8]) -> bool {
        let Some(pdo) = self.inputs.get(usize::from(number) - 1).filter(|pdo| pdo.len() == bytes.len()) else { return false };
        let word = |of, len| pdo::number(bytes, pdo.at(of), len);
        if number == 1 {
            (self.status, self.torque) = (word(pdo::STATUS, 2) as u16, word(pdo::TORQUE, 2));
            self.commander.see(self.status, word(pdo::POSITION, 4));
        } else {
            (self.velocity, self.error) = (word(pdo::VELOCITY, 4), word(pdo::ERROR, 2) as u16);
        }
        true
    }

    /// Takes an emergency; code 0: nothing is wrong any more.
    pub fn heed(&mut self, code: u16) {
        self.emergency = code;
    }

    /// What is wrong with it, as far as it says.
    fn code(&self) -> u16 {
        if self.error != 0 { self.error } else { self.emergency }
    }

    /// Stores what its drive said.
    pub fn show(&self, readings: &mut [u8]) {
        let (slots, commander) = (&self.slots, &self.commander);
        slots.position.set_double(readings, 0, commander.position());
        slots.velocity.set_double(readings, 0, commander.velocity(self.velocity));
        slots.torque.set_double(readings, 0, commander.torque(self.torque));
        if let Some(bias) = slots.bias {
            bias.set_double(readings, 0, 0.0);
        }
        slots.status.of_mut(readings).copy_from_slice(&self.status.to_ne_bytes());
        slots.error.of_mut(readings).copy_from_slice(&self.code().to_ne_bytes());
    }

    /// Why it cannot do what it is engaged for.
    pub fn fault(&self) -> Option<String> {
        let (name, node, code) = (&self.name, self.node, self.code());
        if self.commander.is_wanted() && self.commander.is_faulty() {
            let what = emergency_name(code);
            return Some(format!("axis '{name}' (node {node}) has a fault, {code:#06x}: {what}; remove its cause, then reset the device"));
        }
        let state = self.commander.state();
        self.commander.has_dropped().then(|| {
            format!("axis '{name}' (node {node}) has left operation by itself: it is in '{state}', error {code:#06x}; look at its enable input, then reset the device")
        })
    }

    /// What it is told until the next cycle.
    pub fn told(&mut self, commands: &[u8], is_engaged: bool, span_s: f64) -> Frame {
        let command = self.slots.command.double(commands, 0);
        let (control, target) = self.commander.tell(command, is_engaged, span_s);
        self.frame(control, target)
    }

    /// What it is told while nothing is commanded.
    pub fn told_idle(&mut self) -> Frame {
        let (control, target) = self.commander.tell_idle();
        self.frame(control, target)
    }

    /// What somebody else tells it, where this process is gone.
    pub fn last_word(&self) -> Frame {
        let Scale { mode, counts, offset, .. } = self.scale;
        // No drive goes to its target while it stops; one that did would not leave where it was.
        let target = if mode == Mode::Position { self.commander.position() * counts + offset } else { 0.0 };
        self.frame(cia402::QUICK_STOP, target)
    }

    fn frame(&self, control: u16, target: f64) -> Frame {
        let mut bytes = [0; 6];
        bytes[..2].copy_from_slice(&control.to_le_bytes());
        bytes[2..].copy_from_slice(&(target.round() as i32).to_le_bytes());
        let len = if self.scale.mode == Mode::Torque {
            bytes[2..4].copy_from_slice(&(target.round() as i16).to_le_bytes());
            4
        } else {
            6
        };
        Frame::new(0x200 + u16::from(self.node), &bytes[..len])
    }
}

impl Slots {
    fn new(options: &AxisOptions, layout: &mut Layout) -> Slots {
        let name = &options.name;
        let (unit, speed, force) = if options.unit == Unit::M { ("m", "m/s", "N") } else { ("rad", "rad/s", "N.m") };
        let torque_unit = if options.rated_torque.is_some() { force } else { "" };
        let mut read = |what: &str, of: Type, unit: &str, doc: &str| layout.add(Channel::read(format!("{name}.{what}"), of).unit(unit).doc(doc));
        let position = read("position", Type::DOUBLE, unit, "position");
        let velocity = read("velocity", Type::DOUBLE, speed, "velocity; 0 where the drive does not send it");
        let torque = read("torque", Type::DOUBLE, torque_unit, "torque; without rated_torque as a part of the rated one");
        let bias = (options.mode == Commanded::Torque).then(|| read("bias", Type::DOUBLE, force, "effort that holds it: not known, 0"));
        let status = read("status", Type::of(Number::Uint16), "", "status word of the drive");
        let error = read("error", Type::of(Number::Uint16), "", "error code of the drive, or of its latest emergency; 0 where it has none");
        let write = |what: &str, unit: &str, doc: &str| Channel::write(format!("{name}.{what}"), Type::DOUBLE).unit(unit).doc(doc);
        let command = match options.mode {
            Commanded::Position => write("goal", unit, "where it is to be; NaN: it stays").safe(f64::NAN.to_ne_bytes().to_vec()),
            Commanded::Velocity => write("rate", speed, "how fast it is to move"),
            Commanded::Torque => write("effort", force, "torque that it is to make"),
        };
        Slots { position, velocity, torque, bias, status, error, command: layout.add(command) }
    }
}

/// What can be made a joint of; an axis that is commanded by velocity is its channels alone.
pub fn part(axis: &AxisOptions) -> Option<Part> {
    let command = match axis.mode {
        Commanded::Position => Command::Position,
        Commanded::Torque => Command::Effort,
        Commanded::Velocity => return None,
    };
    let [range_min, range_max] = axis.range.unwrap_or([-UNLIMITED, UNLIMITED]);
    Some(Part {
        name: axis.name.clone(),
        unit: if axis.unit == Unit::M { "m" } else { "rad" },
        range_min,
        range_max,
        effort_max: axis.rated_torque.unwrap_or(UNLIMITED),
        speed_max: axis.speed_max.unwrap_or(UNLIMITED),
        home: 0.0,
        servo: Servo::default(),
        command,
    })
}
