// SPDX-License-Identifier: Apache-2.0
//! A compiled MJCF model, and the description of its arm.
//!
//! The model's fields are read by name, through a batch of one simulation, so that no layout of `mjModel` is assumed. They are changed
//! once in the same way. Actuation is off, because every effort is applied as a generalised force (`qfrc_applied`), so that arms with
//! motors and arms with position servos are commanded alike, by torque. The automatic reset after a numerical failure is off, because a
//! plant that jumps to its start is worse than a lost one. Dry friction of the arm is applied as a force too, because the drives must
//! know it: MuJoCo's is a constraint that is solved after they have produced their efforts.
use super::actuators::{efforts, speeds};
use super::arm::{Arm, JOINT_FREE, Joint, Sensor, Spring, Tool};
use super::compile::compile;
use super::fields::Fields;
use super::followers::followers;
use super::functions::{MuJoCo, object};
use super::{contacts, refusals, survey};
use device::{Command, DriverError, Part, Servo, UNLIMITED};
use std::path::Path;

const DISABLE_ACTUATION: i32 = 1 << 11;
const DISABLE_AUTORESET: i32 = 1 << 16;
const INTEGRATOR_RK4: i32 = 1;
const JOINT_SLIDE: i32 = 2;
const JOINT_HINGE: i32 = 3;
const EQUALITY_OF_JOINTS: i32 = 2;
const SENSOR_TOUCH: i32 = 0;
const SENSOR_ACCELEROMETER: i32 = 1;
const SENSOR_VELOCIMETER: i32 = 2;
const SENSOR_GYRO: i32 = 3;
const SENSOR_FORCE: i32 = 4;
const SENSOR_TORQUE: i32 = 5;
const SENSOR_RANGEFINDER: i32 = 7;
const SENSOR_JOINT_POSITION: i32 = 9;
const SENSOR_JOINT_SPEED: i32 = 10;
const SENSOR_FRAME_POSITION: i32 = 26;
const SENSOR_FRAME_SPEED: i32 = 31;
const SENSOR_FRAME_TURN: i32 = 32;
const SENSOR_FRAME_ACCELERATION: i32 = 33;

/// Loads and compiles an MJCF file. `timestep_s`, if set, replaces the model's own step; `contacts` is the number of sensed contacts.
pub(super) fn load(mujoco: &'static MuJoCo, path: &Path, timestep_s: Option<f64>, contacts: u32) -> Result<Arm, DriverError> {
    let model = compile(mujoco, path, contacts)?;
    let mut arm = Arm::of(mujoco, model);
    let fields = Fields::new(&arm, path)?;
    fields.set_flags("opt.disableflags", DISABLE_ACTUATION | DISABLE_AUTORESET);
    if let Some(step) = timestep_s {
        fields.set_reals("opt.timestep", &[step]);
    }
    let timestep_ns = (fields.reals("opt.timestep")[0] * 1e9).round() as i64;
    let runge_kutta = fields.ints("opt.integrator")[0] == INTEGRATOR_RK4;
    let home = arm.id(object::KEY, "home");
    let joints = joints(&arm, &fields, home);
    let tool = tool(&arm, &fields);
    let sensors = sensors(&arm, &fields);
    let free = free(&arm, &fields);
    let freedoms = freedoms(&arm, &fields);
    let (springs, apart, followers) = (springs(&fields), apart(&fields, &joints), followers(&fields, &joints));
    let (damping, friction, trees) = (fields.reals("dof_damping"), fields.reals("dof_frictionloss"), fields.ints("dof_treeid"));
    if let Some(v) = friction.iter().position(|most| !(0.0..f64::INFINITY).contains(most)) {
        return Err(refusals::model(path, &format!("joint '{}' cannot have the frictionloss {}; give 0 or more", freedoms[v], friction[v])));
    }
    let plant_friction = plant_friction(&fields, &friction, &joints, &apart);
    fields.set_reals("dof_frictionloss", &std::iter::zip(&friction, &plant_friction).map(|(whole, ours)| whole - ours).collect::<Vec<_>>());
    fields.apply();
    if joints.is_empty() {
        return Err(refusals::no_actuated_joint(path));
    }
    if timestep_ns < 1_000 {
        return Err(refusals::model(path, &format!("its time step cannot be {timestep_ns} ns; give at least 1 us")));
    }
    (arm.joints, arm.tool, arm.sensors, arm.free) = (joints, tool, sensors, free);
    (arm.springs, arm.apart, arm.followers, arm.freedoms) = (springs, apart, followers, freedoms);
    (arm.damping, arm.friction, arm.trees) = (damping, friction, trees);
    arm.rubs = plant_friction.iter().any(|most| *most > 0.0);
    arm.plant_friction = plant_friction;
    arm.contacts = (contacts > 0).then(|| (arm.id(object::SENSOR, contacts::SENSOR), contacts as usize));
    (arm.timestep_ns, arm.runge_kutta, arm.home) = (timestep_ns, runge_kutta, home);
    survey::fit(&mut arm);
    Ok(arm)
}

/// Returns the free joints and the indices of their poses.
fn free(arm: &Arm, fields: &Fields) -> Vec<(String, usize)> {
    let (kinds, bodies, first) = (fields.ints("jnt_type"), fields.ints("jnt_bodyid"), fields.ints("jnt_qposadr"));
    let of = |j: usize| (kinds[j] == JOINT_FREE).then(|| (arm.joint_name(j, kinds[j], bodies[j]), first[j] as usize));
    (0..kinds.len()).filter_map(of).collect()
}

/// Returns the names of the joints of the degrees of freedom.
fn freedoms(arm: &Arm, fields: &Fields) -> Vec<String> {
    let (kinds, bodies, of) = (fields.ints("jnt_type"), fields.ints("jnt_bodyid"), fields.ints("dof_jntid"));
    of.iter().map(|&j| arm.joint_name(j as usize, kinds[j as usize], bodies[j as usize])).collect()
}

/// Returns the springs of revolute and prismatic joints.
fn springs(fields: &Fields) -> Vec<Spring> {
    let (kind, position, velocity) = (fields.ints("jnt_type"), fields.ints("jnt_qposadr"), fields.ints("jnt_dofadr"));
    let (stiffness, rest) = (fields.reals("jnt_stiffness"), fields.reals("qpos_spring"));
    let columns = stiffness.len() / kind.len().max(1);
    let of = |j: usize| {
        let (position, velocity, stiffness) = (position[j] as usize, velocity[j] as usize, *stiffness.get(j * columns)?);
        let turns = matches!(kind[j], JOINT_HINGE | JOINT_SLIDE);
        (turns && stiffness != 0.0).then(|| Spring { position, velocity, stiffness, rest: rest[position] })
    };
    (0..kind.len()).filter_map(of).collect()
}

/// Returns the degrees of freedom in body trees without a commanded joint.
fn apart(fields: &Fields, joints: &[Joint]) -> Vec<bool> {
    let tree = fields.ints("dof_treeid");
    tree.iter().map(|of| joints.iter().all(|joint| tree[joint.velocity] != *of)).collect()
}

/// Returns the dry friction that the plant computes: that of the arm, except for joints that follow others by an equality.
fn plant_friction(fields: &Fields, friction: &[f64], joints: &[Joint], apart: &[bool]) -> Vec<f64> {
    let (kinds, firsts, seconds) = (fields.ints("eq_type"), fields.ints("eq_obj1id"), fields.ints("eq_obj2id"));
    let coupled = |joint: i32| (0..kinds.len()).any(|e| kinds[e] == EQUALITY_OF_JOINTS && (firsts[e] == joint || seconds[e] == joint));
    let of = fields.ints("dof_jntid");
    let is_ours = |v: usize| !apart[v] && (joints.iter().any(|joint| joint.velocity == v) || !coupled(of[v]));
    friction.iter().enumerate().map(|(v, most)| if is_ours(v) { *most } else { 0.0 }).collect()
}

/// Returns the joints that are each driven by an actuator of their own, in the order of the joints.
fn joints(arm: &Arm, fields: &Fields, home: i32) -> Vec<Joint> {
    let (kind, position, velocity) = (fields.ints("jnt_type"), fields.ints("jnt_qposadr"), fields.ints("jnt_dofadr"));
    let (limited, range) = (fields.flags("jnt_limited"), fields.reals("jnt_range"));
    let start = fields.reals("qpos0");
    let keys = fields.reals("key_qpos");
    let (efforts, speeds) = (efforts(fields, kind.len()), speeds(fields, kind.len()));
    let mut joints = Vec::new();
    for j in 0..kind.len() {
        let unit = match kind[j] {
            JOINT_HINGE => "rad",
            JOINT_SLIDE => "m",
            _ => continue,
        };
        let Some(effort_max) = efforts[j] else { continue };
        let (q, v) = (position[j] as usize, velocity[j] as usize);
        let home = if home >= 0 { keys[home as usize * start.len() + q] } else { start[q] };
        // If the zero of a file is out of range, the arm stands at the nearest end of the range.
        let home = if limited[j] && range[2 * j] <= range[2 * j + 1] { home.clamp(range[2 * j], range[2 * j + 1]) } else { home };
        let part = Part {
            name: arm.name(object::JOINT, j as i32).unwrap_or_else(|| format!("joint_{j}")),
            unit,
            range_min: if limited[j] { range[2 * j] } else { -UNLIMITED },
            range_max: if limited[j] { range[2 * j + 1] } else { UNLIMITED },
            effort_max,
            speed_max: speeds[j],
            home,
            servo: Servo::default(),
            command: Command::Effort,
        };
        joints.push(Joint { part, position: q, velocity: v, inertia: 1.0, decoupled: Servo::default(), acceleration_max: UNLIMITED });
    }
    joints
}

fn tool(arm: &Arm, fields: &Fields) -> Option<Tool> {
    let (sensor_kind, sensor_site) = (fields.ints("sensor_type"), fields.ints("sensor_objid"));
    let sensed = sensor_kind.iter().position(|k| *k == SENSOR_FORCE);
    let named = ["tool", "attachment_site"].iter().map(|name| arm.id(object::SITE, name)).find(|id| *id >= 0);
    let site = sensed.map(|s| sensor_site[s]).or(named)?;
    let body = fields.ints("site_bodyid")[site as usize];
    let three = |values: Vec<f64>, i: i32| -> [f64; 3] { std::array::from_fn(|k| values[3 * i as usize + k]) };
    Some(Tool { body, site_m: three(fields.reals("site_pos"), site), centre_m: three(fields.reals("body_ipos"), body), sensor: sensed.map(|s| s as i32) })
}

/// Returns all sensors of the model, in order, except the contact sensor that this driver adds; a sensor without a name is called
/// `sensor_N`.
fn sensors(arm: &Arm, fields: &Fields) -> Vec<Sensor> {
    let (kind, elements, object, of) = (fields.ints("sensor_type"), fields.ints("sensor_dim"), fields.ints("sensor_objid"), fields.ints("jnt_type"));
    (0..kind.len())
        .map(|i| {
            let slides = of.get(object[i].max(0) as usize) == Some(&JOINT_SLIDE);
            let name = arm.name(object::SENSOR, i as i32).unwrap_or_else(|| format!("sensor_{i}"));
            Sensor { name, id: i as i32, elements: elements[i].max(1) as usize, unit: sensor_unit(kind[i], slides) }
        })
        .filter(|sensor| sensor.name != contacts::SENSOR)
        .collect()
}

/// Returns the unit of a sensor of that kind (`mjtSensor`); empty if it has none, or if it depends on the model.
fn sensor_unit(kind: i32, slides: bool) -> &'static str {
    match kind {
        SENSOR_TOUCH | SENSOR_FORCE => "N",
        SENSOR_TORQUE => "N.m",
        SENSOR_RANGEFINDER | SENSOR_FRAME_POSITION => "m",
        SENSOR_JOINT_POSITION => {
            if slides {
                "m"
            } else {
                "rad"
            }
        }
        SENSOR_JOINT_SPEED => {
            if slides {
                "m/s"
            } else {
                "rad/s"
            }
        }
        SENSOR_ACCELEROMETER | SENSOR_FRAME_ACCELERATION => "m/s^2",
        SENSOR_VELOCIMETER | SENSOR_FRAME_SPEED => "m/s",
        SENSOR_GYRO | SENSOR_FRAME_TURN => "rad/s",
        _ => "",
    }
}
