// SPDX-License-Identifier: Apache-2.0
//! Channels of an axis, and the part from which a joint can be created.
use super::options::{AxisOptions, CommandKind, Unit};
use device::{Channel, Command, Layout, Number, Part, Servo, Slot, Type, UNLIMITED};

/// Offsets of the channels of an axis.
pub struct Channels {
    pub position: Slot,
    pub velocity: Slot,
    pub torque: Slot,
    pub bias: Option<Slot>,
    pub status: Slot,
    pub error: Slot,
    pub homing: Slot,
    pub operating: Slot,
    pub command: Slot,
}

impl Channels {
    pub fn new(options: &AxisOptions, layout: &mut Layout) -> Channels {
        let name = &options.name;
        let (unit, speed, force) = if options.unit == Unit::M { ("m", "m/s", "N") } else { ("rad", "rad/s", "N.m") };
        let torque_unit = if options.rated_torque.is_some() { force } else { "" };
        let mut read = |what: &str, of: Type, unit: &str, doc: &str| layout.add(Channel::read(format!("{name}.{what}"), of).unit(unit).doc(doc));
        let position = read("position", Type::DOUBLE, unit, "position");
        let velocity = read("velocity", Type::DOUBLE, speed, "velocity; 0 if the drive does not send it");
        let torque = read("torque", Type::DOUBLE, torque_unit, "torque; without rated_torque as a fraction of the rated torque");
        let bias = (options.mode == CommandKind::Torque).then(|| read("bias", Type::DOUBLE, force, "effort that holds the axis: not known, 0"));
        let status = read("status", Type::of(Number::Uint16), "", "status word of the drive");
        let error = read("error", Type::of(Number::Uint16), "", "error code of the drive; 0 if it has none");
        let homing = read("homing", Type::of(Number::Uint8), "", "0 not yet, 1 on the way home, 2 home, 3 home was not found");
        let operating = read("operating", Type::BOOL, "", "whether the drive is in operation and follows its commands");
        let write = |what: &str, unit: &str, doc: &str| Channel::write(format!("{name}.{what}"), Type::DOUBLE).unit(unit).doc(doc);
        let command = match options.mode {
            CommandKind::Position => write("goal", unit, "goal position; NaN: it stays").safe(f64::NAN.to_ne_bytes().to_vec()),
            CommandKind::Velocity => write("rate", speed, "commanded velocity"),
            CommandKind::Torque => write("effort", force, "commanded torque"),
        };
        Channels { position, velocity, torque, bias, status, error, homing, operating, command: layout.add(command) }
    }
}

/// Returns the part from which a joint can be created; `None` for a velocity-commanded axis, which has only channels.
pub fn part(axis: &AxisOptions) -> Option<Part> {
    let command = match axis.mode {
        CommandKind::Position => Command::Position,
        CommandKind::Torque => Command::Effort,
        CommandKind::Velocity => return None,
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
