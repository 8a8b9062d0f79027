// SPDX-License-Identifier: Apache-2.0
//! Taught points of arms, in the text files that programs named for them. People, programs and pages change one file at a time: a change reads
//! what is there, alters one entry and writes the file whole or not at all, so that comments, order and the points of others stay.
mod document;
mod store;

use document::PointDocument;
use model::refusal::{Class, Refusal, Refusals};
use serde::{Deserialize, Serialize};
use supervisor::PointFile;

/// Frame of a point that is joint positions.
pub const JOINTS: &str = "joints";
/// Frame in which the poses of the arm are given.
pub const WORLD: &str = "world";

/// A taught point: joint positions, or a pose in a frame with the joints at which it was taught.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TaughtPoint {
    pub name: String,
    /// Positions of the joints when it was taught, in the order of the arm, rad or m.
    pub joints: Vec<f64>,
    /// `joints` of joint positions; `world` or the name of a work frame of a pose.
    #[serde(default = "joints")]
    pub frame: String,
    /// Frame of `tools` whose pose it is; null: the tool that the arm has.
    #[serde(default)]
    pub tool: Option<String>,
    /// Place in its frame, m.
    #[serde(default)]
    pub position: Option<[f64; 3]>,
    /// Roll, pitch and yaw in its frame, degrees.
    #[serde(default)]
    pub rpy_deg: Option<[f64; 3]>,
    /// Signs of shoulder, elbow and wrist, where the arm has such configurations.
    #[serde(default)]
    pub configuration: Option<String>,
    /// Turns of the joints in that configuration.
    #[serde(default)]
    pub turns: Vec<i64>,
    /// Words for people.
    #[serde(default)]
    pub note: String,
    /// Time at which it was taught, RFC 3339.
    #[serde(default)]
    pub taught: Option<String>,
}

fn joints() -> String {
    JOINTS.to_owned()
}

/// A work frame, or a tool in the frame of the flange.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NamedFrame {
    pub name: String,
    /// m
    pub position: [f64; 3],
    /// Roll, pitch and yaw, degrees.
    pub rpy_deg: [f64; 3],
}

/// The taught points of an arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TaughtPoints {
    /// Path of the file on the host of the system.
    pub file: String,
    /// Joints of the arm, by their short names.
    pub joints: Vec<String>,
    /// In the order of the file.
    pub points: Vec<TaughtPoint>,
    pub frames: Vec<NamedFrame>,
    pub tools: Vec<NamedFrame>,
}

/// Returns the points of a file; none where there is no file yet. Errors: it cannot be read or understood, or is of another arm.
pub fn read(file: &PointFile) -> Result<TaughtPoints, Refusals> {
    let document = PointDocument::of(store::read(&file.path)?, file)?;
    Ok(document.points())
}

/// Enters a point, in the place of the one of that name. Errors: as of [`read`]; it is not one of this arm; the file cannot be written.
pub fn teach(file: &PointFile, point: &TaughtPoint) -> Result<(), Refusals> {
    change(file, |document| document.put(point))
}

/// Gives a point another name; it keeps its place. Errors: there is none, or one of the new name.
pub fn rename(file: &PointFile, name: &str, to: &str) -> Result<(), Refusals> {
    change(file, |document| document.rename(name, to))
}

/// Removes a point, and returns it. Errors: there is none.
pub fn delete(file: &PointFile, name: &str) -> Result<TaughtPoint, Refusals> {
    change(file, |document| document.remove(name))
}

fn change<T>(file: &PointFile, change: impl FnOnce(&mut PointDocument) -> Result<T, Refusals>) -> Result<T, Refusals> {
    let _locked = store::lock(&file.path)?;
    let mut document = PointDocument::of(store::read(&file.path)?, file)?;
    let done = change(&mut document)?;
    store::write(&file.path, &document.text())?;
    Ok(done)
}

fn refuse(class: Class, message: impl Into<String>, remedy: impl Into<String>) -> Refusals {
    vec![Refusal::new(class, message).remedy(remedy)]
}
