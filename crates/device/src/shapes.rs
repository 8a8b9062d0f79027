// SPDX-License-Identifier: Apache-2.0
//! Shapes of a machine, for a viewer.
use serde::Serialize;

/// Bodies of a machine for drawing. Lengths are in metres, quaternions are w x y z, and poses are relative to the parent.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Geometry {
    /// Bodies in the order of the model; the first is the world.
    pub bodies: Vec<Body>,
    pub meshes: Vec<Mesh>,
    /// Name under which contacts are read, six numbers each: position, m, and force, N, in the world frame; null if contacts are not
    /// reported.
    pub contacts: Option<String>,
}

/// A body: its pose relative to its parent, its joint, and its shapes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "GeometryBody"))]
pub struct Body {
    pub name: String,
    /// Parent; null for the world.
    pub parent: Option<String>,
    pub position: [f64; 3],
    /// w x y z.
    pub quaternion: [f64; 4],
    /// First joint of the body.
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
    /// Position of a revolute or prismatic joint in the drawn model, rad or m. A viewer rotates or moves the body by position -
    /// reference.
    pub reference: Option<f64>,
    /// Name under which the joint's position is read; null if no channel reports it.
    pub svv: Option<String>,
}

/// Type of joint.
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
    /// Size in MuJoCo's convention: half lengths, radii.
    pub size: [f64; 3],
    pub position: [f64; 3],
    /// w x y z.
    pub quaternion: [f64; 4],
    /// Red, green, blue, opacity, 0 to 1.
    pub rgba: [f32; 4],
    /// Index into the meshes; null if the shape is drawn according to its kind.
    pub mesh: Option<usize>,
}

/// Triangle mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "GeometryMesh"))]
pub struct Mesh {
    /// Coordinates, three per vertex.
    pub vertices: Vec<f64>,
    /// Vertex indices, three per face.
    pub faces: Vec<usize>,
}
