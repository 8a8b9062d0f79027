// SPDX-License-Identifier: Apache-2.0
//! A robot arm simulated by MuJoCo: one MJCF file is one physical device, each actuated joint one part.
//!
//! Options: `path` (the MJCF file), `library` (folder of the Python package `mujoco`, or the library itself; else the environment
//! variable `OPENGPAC_MUJOCO`), `timestep` (s, instead of the model's own).
//!
//! | channel | type, unit | |
//! |---|---|---|
//! | `<joint>.position` | double, rad (slide: m) | read |
//! | `<joint>.velocity` | double, rad/s (m/s) | read |
//! | `<joint>.bias` | double, N.m (N) | read: the effort that holds the arm against gravity, Coriolis and centrifugal force |
//! | `<joint>.effort` | double, N.m (N) | write, safe value 0 |
//! | `tool.force` | double[3], N | read: what the tool does to the flange, in the frame of the sensor's site |
//! | `sensor.<name>` | double or double[k], the sensor's unit | read: a sensor of the model (touch, force, joint and frame positions, …) |
//! | `tool.push` | double[3], N | write, safe value 0: a force from outside at the tool, in the world frame, for tests |
//!
//! **Effort** is a generalised force at the joint, within the limits of the model, whatever actuator the model has there: motors
//! and position servos of an MJCF file are commanded alike. An actuator that drives no single joint exerts nothing.
//! **Brakes**: a joint whose effort channel is not claimed keeps its position, as by a spring-applied brake.
//! **Time**: reading a firing advances the plant to the release time in whole steps, under the efforts written last: one period
//! of delay, as in a real drive. The same commands at the same release times give the same bits.
mod brake;
mod channels;
mod geometry;
mod library;
mod log;
mod model;
mod plant;
mod trial;

pub use trial::tried_with;

use crate::{DriverError, driver};
use kernel::Driver;
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    path: PathBuf,
    library: Option<PathBuf>,
    timestep: Option<f64>,
}

/// What the model looks like: the same model, loaded once more.
pub(crate) fn geometry(options: &Value) -> Result<Value, DriverError> {
    let options: Options = driver::options("mujoco", options)?;
    let arm = model::load(library::load(options.library.as_deref())?, &options.path, options.timestep)?;
    let fields = model::Fields::new(&arm, &options.path)?;
    Ok(geometry::geometry(&arm, &fields))
}

/// Tries a model in a process of its own, for whoever is about to load it with a MuJoCo of theirs. Without the library there is nothing
/// to try. Errors: what is wrong with the model.
pub fn try_model(path: &Path, library: Option<&Path>) -> Result<(), DriverError> {
    model::whole(path).and_then(|whole| match library::find(library) {
        Ok(library) => model::tried(&library, path, &whole),
        Err(_missing) => Ok(()),
    })
}

/// Loads the library and the model. The description: `{"parts": […], "tool": bool, "timestep": s}`.
pub(crate) fn open(options: &Value) -> Result<(Box<dyn Driver>, Value), DriverError> {
    let options: Options = driver::options("mujoco", options)?;
    if let Some(step) = options.timestep
        && !(1e-6..=0.1).contains(&step)
    {
        return Err(DriverError::Option { kind: "mujoco".into(), option: "timestep".into(), problem: format!("{step} s is not within 1e-6 s to 0.1 s") });
    }
    let mujoco = library::load(options.library.as_deref())?;
    let arm = model::load(mujoco, &options.path, options.timestep)?;
    let parts: Vec<_> = arm.joints.iter().map(|joint| joint.part.clone()).collect();
    let about = json!({ "parts": parts, "tool": arm.tool.is_some(), "timestep": arm.timestep_ns as f64 * 1e-9 });
    Ok((Box::new(plant::Plant::new(arm)), about))
}
