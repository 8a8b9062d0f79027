// SPDX-License-Identifier: Apache-2.0
//! Shapes of a machine, for a viewer.
use serde::Serialize;

/// Bodies of a machine for drawing. Metres; quaternions w x y z; places are those on the parent.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Geometry {
    /// Bodies in the order of the model; the first is the world.
    pub bodies: Vec<Body>,
    pub meshes: Vec<Mesh>,
    /// The name by which contacts are read, six numbers each: place, m, and force, N, in the world; null: none are told.
    pub contacts: Option<String>,
}

/// A body: where it is on its parent, how it moves, its shapes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "GeometryBody"))]
pub struct Body {
    pub name: String,
    /// Null of the world.
    pub parent: Option<String>,
    pub position: [f64; 3],
    /// w x y z.
    pub quaternion: [f64; 4],
    /// The first of its joints.
    pub joint: Option<Joint>,
    pub joints: Vec<Joint>,
    pub geoms: Vec<Shape>,
}

/// A joint of a body.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "GeometryJoint"))]
pub struct Joint {
    pub name: String,
    pub kind: JointKind,
    pub axis: [f64; 3],
    pub position: [f64; 3],
    /// Position of a hinge or slide as the model is drawn, rad or m. A page turns by position - reference.
    pub reference: Option<f64>,
    /// The name by which its position is read; null: no channel tells it.
    pub svv: Option<String>,
}

/// Kind of a joint's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum JointKind {
    Free,
    Ball,
    Slide,
    Hinge,
}

/// A shape of a body.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "GeometryGeom"))]
pub struct Shape {
    /// `plane`, `hfield`, `sphere`, `capsule`, `ellipsoid`, `cylinder`, `box`, `mesh`, `sdf`.
    pub kind: String,
    /// Size as MuJoCo counts it: half lengths, radii.
    pub size: [f64; 3],
    pub position: [f64; 3],
    /// w x y z.
    pub quaternion: [f64; 4],
    /// Red, green, blue, opacity, 0 to 1.
    pub rgba: [f32; 4],
    /// Index into the meshes; null: it is drawn as its kind says.
    pub mesh: Option<usize>,
}

/// Triangles.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "GeometryMesh"))]
pub struct Mesh {
    /// Three numbers a vertex.
    pub vertices: Vec<f64>,
    /// Three vertices a face.
    pub faces: Vec<usize>,
}
