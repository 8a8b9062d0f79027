// SPDX-License-Identifier: Apache-2.0
//! Channels of an arm, and their layout: joints in the order of the model, then the force, the sensors and the free bodies.
use super::arm::{Arm, Joint};
use super::contacts::GIVEN;
use device::{Channel, Layout, Slot, Type};

/// Slots of the values of an arm.
pub(super) struct Slots {
    /// Slots of each joint: position, velocity, bias, motor effort and motor limit; then, separately, the commanded effort.
    pub joints: Vec<([Slot; 5], Slot)>,
    pub force: Option<Slot>,
    pub sensors: Vec<Slot>,
    pub contacts: Option<Slot>,
    /// Pose of each free body.
    pub free: Vec<Slot>,
    pub push: Option<Slot>,
    /// Decoupled effort of each joint, and the index of the first one among the write channels.
    pub decoupled: Vec<Slot>,
    pub first_decoupled: usize,
}

/// Returns all channels of an arm.
pub(super) fn channels(arm: &Arm) -> (Vec<Channel>, Slots) {
    let mut layout = Layout::default();
    let effort_unit = |unit: &str| if unit == "rad" { "N.m" } else { "N" };
    let mut reads = Vec::new();
    for joint in &arm.joints {
        let (name, unit) = (&joint.part.name, joint.part.unit);
        let mut read = |of: &str, unit: String, doc: &str| layout.add(Channel::read(format!("{name}.{of}"), Type::DOUBLE).unit(unit).doc(doc));
        reads.push([
            read("position", unit.into(), "joint position"),
            read("velocity", format!("{unit}/s"), "joint velocity"),
            read("bias", effort_unit(unit).into(), "effort against gravity, Coriolis and centrifugal force"),
            read("motor_effort", effort_unit(unit).into(), "effort of the motor in the last time step, within its limit; 0 while the brake holds the joint"),
            read("motor_limit", effort_unit(unit).into(), "maximum effort of the motor either way"),
        ]);
    }
    let has_force = arm.tool.as_ref().is_some_and(|tool| tool.sensor.is_some());
    let force = Channel::read("tool.force", Type::doubles(3)).unit("N").doc("force of the tool on the flange, in the sensor's frame");
    let force = has_force.then(|| layout.add(force));
    let sensor = |sensor: &super::arm::Sensor| {
        Channel::read(format!("sensor.{}", sensor.name), Type::doubles(sensor.elements))
            .unit(sensor.unit)
            .doc("a sensor of the model, as the model declares it")
    };
    let sensors = arm.sensors.iter().map(|of| layout.add(sensor(of))).collect();
    let contacts = |(_, count): (i32, usize)| {
        let doc = "contacts with the largest forces: position, x y z, m, and force of the first shape on the second, x y z, N, in the world frame";
        layout.add(Channel::read("contacts", Type::doubles(GIVEN * count)).doc(doc))
    };
    let contacts = arm.contacts.map(contacts);
    let pose = |name: &str| Channel::read(format!("{name}.pose"), Type::doubles(7)).doc("position x y z, m, of the free body, then its orientation as w x y z");
    let free = arm.free.iter().map(|(name, _)| layout.add(pose(name))).collect();
    let joints = arm.joints.iter().zip(reads).map(|(joint, reads)| {
        let effort = Channel::write(format!("{}.effort", joint.part.name), Type::DOUBLE).unit(effort_unit(joint.part.unit));
        (reads, layout.add(effort.doc("effort at the joint; the brake holds it while neither this channel nor 'decoupled' is claimed")))
    });
    let joints: Vec<_> = joints.collect();
    let push = Channel::write("tool.push", Type::doubles(3)).unit("N").doc("force from outside at the tool, in the world frame");
    let push = arm.tool.as_ref().map(|_| layout.add(push));
    let first_decoupled = joints.len() + usize::from(push.is_some());
    let decoupled = |joint: &Joint| {
        let channel = Channel::write(format!("{}.decoupled", joint.part.name), Type::DOUBLE).unit(effort_unit(joint.part.unit));
        let channel = channel.doc("effort that moves only the joint's own inertia: the drive adds what the other joints and gravity need");
        layout.add(channel.safe(f64::NAN.to_ne_bytes().to_vec()))
    };
    let decoupled = arm.joints.iter().map(decoupled).collect();
    (layout.into_channels(), Slots { joints, force, sensors, contacts, free, push, decoupled, first_decoupled })
}
