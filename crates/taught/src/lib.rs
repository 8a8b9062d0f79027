// SPDX-License-Identifier: Apache-2.0
//! Taught points of arms, in text files whose paths are set by programs. People, programs and the studio may change the same file
//! concurrently: each change reads the file, alters one entry and writes the file atomically, so that comments, order and other points
//! are preserved.
mod document;
mod store;

use document::PointDocument;
use model::refusal::{Class, Refusal, Refusals};
use serde::{Deserialize, Serialize};
use supervisor::PointFile;

/// Frame name of a point that consists of joint positions.
pub const JOINTS: &str = "joints";
/// Name of the frame in which the arm's poses are expressed.
pub const WORLD: &str = "world";

/// A taught point: joint positions, or a pose in a frame with the joints at which it was taught.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TaughtPoint {
    pub name: String,
    /// Joint positions at the time of teaching, in the order of the arm, rad or m.
    pub joints: Vec<f64>,
    /// `joints` for joint positions; `world` or the name of a work frame for a pose.
    #[serde(default = "joints")]
    pub frame: String,
    /// Frame in `tools` to which the pose applies; null for the tool of the arm.
    #[serde(default)]
    pub tool: Option<String>,
    /// Position in its frame, m.
    #[serde(default)]
    pub position: Option<[f64; 3]>,
    /// Roll, pitch and yaw in its frame, degrees.
    #[serde(default)]
    pub rpy_deg: Option<[f64; 3]>,
    /// Signs of the shoulder, elbow and wrist configuration, if the arm has such configurations.
    #[serde(default)]
    pub configuration: Option<String>,
    /// Revolutions of the joints in that configuration.
    #[serde(default)]
    pub turns: Vec<i64>,
    /// Free-text comment.
    #[serde(default)]
    pub note: String,
    /// Time of teaching, RFC 3339.
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
    /// Points, in the order of the file.
    pub points: Vec<TaughtPoint>,
    pub frames: Vec<NamedFrame>,
    pub tools: Vec<NamedFrame>,
}

/// Returns the points in a file; empty if the file does not exist yet. Fails if the file cannot be read or parsed, or belongs to another
/// arm.
pub fn read(file: &PointFile) -> Result<TaughtPoints, Refusals> {
    let document = PointDocument::of(store::read(&file.path)?, file)?;
    Ok(document.points())
}

/// Appends a point, or replaces the point of the same name in place. Fails as [`read`] does, if the point does not belong to this arm, or
/// if the file cannot be written.
pub fn teach(file: &PointFile, point: &TaughtPoint) -> Result<(), Refusals> {
    change(file, |document| document.put(point))
}

/// Renames a point, which keeps its place in the file. Fails if the point does not exist, or if the new name is already in use.
pub fn rename(file: &PointFile, name: &str, to: &str) -> Result<(), Refusals> {
    change(file, |document| document.rename(name, to))
}

/// Removes and returns a point. Fails if the point does not exist.
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
