// SPDX-License-Identifier: Apache-2.0
//! The channels of an arm, and where they lie: readings are three numbers a joint, then the force, then the sensors; commands one a joint, then the push.
use super::model::Arm;
use kernel::{Channel, Direction};

/// All channels of an arm, joints in the order of the model.
pub(super) fn channels(arm: &Arm) -> Vec<Channel> {
    let mut channels = Vec::new();
    let mut add = |name: String, direction, elements: usize, unit: String, doc: &str, offset| {
        channels.push(Channel {
            name,
            direction,
            type_text: if elements == 1 { "double".into() } else { format!("double[{elements}]") },
            unit,
            doc: doc.into(),
            offset,
            len: 8 * elements,
            safe: if direction == Direction::Write { vec![0; 8 * elements] } else { vec![] },
            slew_max: None,
        });
    };
    let mut place = 0;
    for joint in &arm.joints {
        let (name, unit) = (&joint.part.name, joint.part.unit);
        let effort = if unit == "rad" { "N.m" } else { "N" };
        add(format!("{name}.position"), Direction::Read, 1, unit.into(), "joint position", place);
        add(format!("{name}.velocity"), Direction::Read, 1, format!("{unit}/s"), "joint velocity", place + 8);
        add(format!("{name}.bias"), Direction::Read, 1, effort.into(), "effort against gravity, Coriolis and centrifugal force", place + 16);
        place += 24;
    }
    if arm.tool.as_ref().is_some_and(|tool| tool.sensor.is_some()) {
        add("tool.force".into(), Direction::Read, 3, "N".into(), "force of the tool on the flange, in the sensor's frame", place);
        place += 24;
    }
    for sensor in &arm.sensors {
        add(format!("sensor.{}", sensor.name), Direction::Read, sensor.elements, sensor.unit.into(), "a sensor of the model, as the model declares it", place);
        place += 8 * sensor.elements;
    }
    for (j, joint) in arm.joints.iter().enumerate() {
        let effort = if joint.part.unit == "rad" { "N.m" } else { "N" };
        add(
            format!("{}.effort", joint.part.name),
            Direction::Write,
            1,
            effort.into(),
            "effort at the joint; the brake holds it while nobody claims this channel",
            8 * j,
        );
    }
    if arm.tool.is_some() {
        add("tool.push".into(), Direction::Write, 3, "N".into(), "force from outside at the tool, in the world frame", 8 * arm.joints.len());
    }
    channels
}
