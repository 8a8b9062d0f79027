// SPDX-License-Identifier: Apache-2.0
//! An arm as described by its model: joints, tool, sensors, springs and followers, together with the compiled model.
use super::functions::{Model, MuJoCo, object};
use device::{Part, Servo};
use serde_json::{Value, json};
use std::ffi::{CStr, CString};

/// `mjtJoint` of a free body.
pub(super) const JOINT_FREE: i32 = 0;
/// Number of coefficients of the polynomial that couples two joints.
pub(super) const TERMS: usize = 5;

/// A commanded joint.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub part: Part,
    /// Index of the joint's position in qpos and of its velocity in qvel.
    pub position: usize,
    pub velocity: usize,
    /// Inertia moved by a decoupled effort, kg.m^2 (kg), and the gains of a servo that uses decoupled efforts.
    pub inertia: f64,
    pub decoupled: Servo,
    /// Acceleration that the efforts of all joints can achieve simultaneously in every pose, rad/s^2 (m/s^2).
    pub acceleration_max: f64,
}

impl Joint {
    /// Returns the description of the joint for programs that use the driver.
    pub fn about(&self) -> Value {
        let mut about = json!(self.part);
        about["decoupled"] = json!(self.decoupled);
        about["acceleration_max"] = json!(self.acceleration_max);
        about
    }
}

/// Spring of a joint: effort = -stiffness (position - rest).
#[derive(Clone, Copy, Debug)]
pub(super) struct Spring {
    pub position: usize,
    pub velocity: usize,
    pub stiffness: f64,
    pub rest: f64,
}

/// Location of the tool: a site named `tool` or `attachment_site`, otherwise the site of the first force sensor.
#[derive(Clone, Debug)]
pub(super) struct Tool {
    pub body: i32,
    /// Site and centre of mass of its body, in the body's frame.
    pub site_m: [f64; 3],
    pub centre_m: [f64; 3],
    /// Force sensor at the site, if the model has one.
    pub sensor: Option<i32>,
}

/// A degree of freedom that moves with another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower {
    pub velocity: usize,
    pub position: usize,
    /// Index of the leader in qvel and in qpos.
    pub leader: (usize, usize),
    /// Polynomial that gives q_1 - rest_1 as a function of q_2 - rest_2; the follower is joint 1, or joint 2 if `is_second`.
    pub terms: [f64; TERMS],
    pub rest: (f64, f64),
    pub is_second: bool,
}

/// A sensor of the model.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    pub name: String,
    /// Identifier of the sensor in the model, and the number of its values.
    pub id: i32,
    pub elements: usize,
    pub unit: &'static str,
}

/// A compiled model; freed when dropped.
pub(super) struct Arm {
    pub mujoco: &'static MuJoCo,
    pub model: *mut Model,
    pub joints: Vec<Joint>,
    pub tool: Option<Tool>,
    pub sensors: Vec<Sensor>,
    /// Contact sensor, and the number of contacts that it reports.
    pub contacts: Option<(i32, usize)>,
    /// Free bodies: name of the joint, and the index of its pose in qpos.
    pub free: Vec<(String, usize)>,
    /// Viscous damping and dry friction of each degree of freedom.
    pub damping: Vec<f64>,
    pub friction: Vec<f64>,
    /// Part of the friction that is computed by the plant, and a flag that is true if there is any. MuJoCo computes the friction of
    /// followers and of the degrees of freedom in `apart`.
    pub plant_friction: Vec<f64>,
    pub rubs: bool,
    /// Body tree of each degree of freedom. Two trees interact only through contacts.
    pub trees: Vec<i32>,
    pub springs: Vec<Spring>,
    /// Degrees of freedom that move with others, each before its leader.
    pub followers: Vec<Follower>,
    /// True for each degree of freedom in a body tree without a commanded joint, which is not affected by the arm's inertia.
    pub apart: Vec<bool>,
    /// Name of the joint of each degree of freedom.
    pub freedoms: Vec<String>,
    pub timestep_ns: i64,
    pub runge_kutta: bool,
    /// Index of the keyframe `home`, or -1.
    pub home: i32,
}

// SAFETY: the model is owned by this value and constant after `load`; MuJoCo keeps no thread-local state about it.
unsafe impl Send for Arm {}

impl Drop for Arm {
    fn drop(&mut self) {
        // SAFETY: the model came from `mj_loadXML` and is freed only here.
        unsafe { (self.mujoco.mj_deleteModel)(self.model) }
    }
}

impl Arm {
    pub fn of(mujoco: &'static MuJoCo, model: *mut Model) -> Arm {
        Arm {
            mujoco,
            model,
            joints: vec![],
            tool: None,
            sensors: vec![],
            contacts: None,
            free: vec![],
            damping: vec![],
            friction: vec![],
            plant_friction: vec![],
            rubs: false,
            trees: vec![],
            springs: vec![],
            followers: vec![],
            apart: vec![],
            freedoms: vec![],
            timestep_ns: 0,
            runge_kutta: false,
            home: -1,
        }
    }

    pub fn id(&self, object: i32, name: &str) -> i32 {
        let name = CString::new(name).expect("names here contain no NUL");
        // SAFETY: the model is valid and the name ends in NUL.
        unsafe { (self.mujoco.mj_name2id)(self.model, object, name.as_ptr()) }
    }

    pub fn name(&self, object: i32, id: i32) -> Option<String> {
        // SAFETY: the model is valid; an id without a name gives null.
        let name = unsafe { (self.mujoco.mj_id2name)(self.model, object, id) };
        // SAFETY: a name ends in NUL and lives as long as the model.
        (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned())
    }

    /// Returns the name of a joint; a free joint without a name takes the name of its body.
    pub fn joint_name(&self, joint: usize, kind: i32, body: i32) -> String {
        let of_body = || (kind == JOINT_FREE).then(|| self.name(object::BODY, body)).flatten();
        self.name(object::JOINT, joint as i32).or_else(of_body).unwrap_or_else(|| format!("joint_{joint}"))
    }
}
