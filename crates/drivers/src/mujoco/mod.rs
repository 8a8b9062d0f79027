// SPDX-License-Identifier: Apache-2.0
//! A robot arm simulated by MuJoCo: one MJCF file is one physical device, each actuated joint one part.
//!
//! | channel | type, unit | |
//! |---|---|---|
//! | `<joint>.position` | double, rad (slide: m) | read |
//! | `<joint>.velocity` | double, rad/s (m/s) | read |
//! | `<joint>.bias` | double, N.m (N) | read: the effort that holds the arm against gravity, Coriolis and centrifugal forces |
//! | `<joint>.motor_effort` | double, N.m (N) | read: the effort of its motor in the last time step, whatever was commanded; 0 while the brake holds the joint |
//! | `<joint>.motor_limit` | double, N.m (N) | read: the maximum magnitude of the effort of its motor |
//! | `<joint>.effort` | double, N.m (N) | write, safe value 0 |
//! | `<joint>.decoupled` | double, N.m (N) | write, safe value NaN (none): the effort of a servo that moves only this joint's own inertia; the drive adds the effort that the model requires for gravity and the other joints (computed torque) |
//! | `tool.force` | double[3], N | read: the force of the tool on the flange, in the frame of the sensor's site |
//! | `sensor.<name>` | double or double[k], the sensor's unit | read: a sensor of the model (touch, force, joint and frame positions, …) |
//! | `<joint>.pose` | double[7] | read: the pose of a free body, x y z in m, then its quaternion w x y z; a joint without a name takes the name of its body |
//! | `contacts` | double[6 n] | read, with the option `contacts`: for each of the n contacts with the largest forces its position, x y z in m, and the force of its first shape on its second, x y z in N, in the world frame; zeros if there are fewer |
//! | `tool.push` | double[3], N | write, safe value 0: an external force at the tool, in the world frame, for tests |
//!
//! **Effort** is a generalised force at the joint, within the limits of the model, whatever actuator the model has there: motors and
//! position servos of an MJCF file are commanded alike. An actuator that does not drive a single joint has no effect. A decoupled effort
//! and an effort of the same joint are added.
//!
//! **Brakes**: a joint with neither channel claimed keeps its position, as with a spring-applied brake.
//!
//! **Time**: a reading advances the plant to the release time in whole steps, under the last written efforts: one period of delay, as in
//! a real drive. The same commands at the same release times give bit-identical results.
//!
//! **Service** `place` moves the arm instantly to another position, at rest; its earlier motion has no further effect.
mod actuators;
mod arm;
mod channels;
mod compile;
mod contacts;
mod decoupled;
mod fields;
mod followers;
mod functions;
mod geometry;
mod library;
mod loads;
mod log;
mod meshes;
mod model;
mod motion;
mod placing;
mod plant;
mod prescribed;
mod refusals;
mod survey;
mod trial;

use device::{Declaration, DriverError, Geometry, GivenOptions, Kind, OpenedDriver, OptionWord, Reach, SafeState};
use serde::Deserialize;
use serde_json::json;
use std::path::PathBuf;

pub(crate) static DRIVER: Declaration = Declaration {
    geometry: Some(shape),
    trial: Some(tried),
    safe_state: SafeState::OF_SIMULATION,
    services: &placing::SERVICES,
    ..Declaration::new("mujoco", "a robot arm simulated by MuJoCo, from any MJCF file", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 4] = [
    OptionWord::needed("path", Kind::Text, "the MJCF file").reaches(Reach::File),
    OptionWord::with_default("library", Kind::Text, "the value of OPENGPAC_MUJOCO", "folder of the Python package 'mujoco', or its library itself")
        .reaches(Reach::Code),
    OptionWord::with_default("timestep", Kind::Number, "that of the model", "its time step").unit("s").within(1e-6, 0.1),
    OptionWord::with_default("contacts", Kind::Whole, "0", "number of contacts in the channel `contacts`, the largest forces first")
        .within(0.0, contacts::CONTACTS_MAX as f64),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    path: PathBuf,
    library: Option<PathBuf>,
    timestep: Option<f64>,
    #[serde(default)]
    contacts: u32,
}

/// Returns the shapes of the model, which is loaded again for this purpose.
fn shape(given: &GivenOptions<'_>) -> Result<Option<Geometry>, DriverError> {
    let options: Options = given.read()?;
    let mujoco = library::load(options.library.as_deref())?;
    let arm = model::load(mujoco, &options.path, options.timestep, options.contacts)?;
    let fields = fields::Fields::new(&arm, &options.path)?;
    Ok(Some(geometry::geometry(&arm, &fields, |asked| meshes::read(&mujoco.path, &options.path, asked))))
}

/// Tries a model in a separate process, for a program that is about to load it with its own MuJoCo. Does nothing if the library is not
/// installed.
fn tried(given: &GivenOptions<'_>) -> Result<(), DriverError> {
    let options: Options = given.read()?;
    compile::whole(&options.path).and_then(|whole| match library::find(options.library.as_deref()) {
        Ok(library) => compile::tried(&library, &options.path, &whole),
        Err(_missing) => Ok(()),
    })
}

/// Loads the library and the model. The description is `{"parts": […], "tool": bool, "timestep": s}`.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let mujoco = library::load(options.library.as_deref())?;
    let arm = model::load(mujoco, &options.path, options.timestep, options.contacts)?;
    let parts: Vec<_> = arm.joints.iter().map(arm::Joint::about).collect();
    let about = json!({ "parts": parts, "tool": arm.tool.is_some(), "timestep": arm.timestep_ns as f64 * 1e-9 });
    Ok((Box::new(plant::Plant::new(arm)), about))
}
