// SPDX-License-Identifier: Apache-2.0
//! Bodies of a model for drawing: the pose of each relative to its parent, its joint, its shapes. Collision shapes (group 3 and above),
//! which MuJoCo's own viewer hides, are omitted.
use super::arm::Arm;
use super::fields::Fields;
use super::functions::object;
use device::{Body, Geometry, Joint, JointKind, Mesh, Shape};
use std::collections::BTreeMap;

/// Number of groups of shapes that are shown.
const GROUPS_SHOWN: i32 = 3;
/// Default colour of a shape without a colour in the model.
const COLOUR_DEFAULT: [f32; 4] = [0.5, 0.5, 0.5, 1.0];
/// `mjtGeom`, by number; a mesh without its triangles is shown as a box.
const SHAPES: [&str; 9] = ["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "box", "sdf"];
const MESH: i32 = 7;
/// `mjtJoint`, by number.
const JOINTS: [JointKind; 4] = [JointKind::Free, JointKind::Ball, JointKind::Slide, JointKind::Hinge];

/// Returns the bodies in the order of the model; the first is the world. `triangles` returns the meshes with the given numbers.
pub(super) fn geometry(arm: &Arm, fields: &Fields, triangles: impl FnOnce(&[i32]) -> Vec<Option<Mesh>>) -> Geometry {
    let (parents, positions, turns) = (fields.ints("body_parentid"), fields.reals("body_pos"), fields.reals("body_quat"));
    let name = |body: usize| arm.name(object::BODY, body as i32).unwrap_or_else(|| format!("body_{body}"));
    let joints = joints(arm, fields);
    let (shapes, meshes) = shapes(fields, triangles);
    let bodies = (0..parents.len()).map(|body| {
        let joints = of_body(body, &joints);
        Body {
            name: name(body),
            parent: (body > 0).then(|| name(parents[body] as usize)),
            position: row(&positions, body),
            quaternion: row(&turns, body),
            joint: joints.first().cloned(),
            joints,
            geoms: of_body(body, &shapes),
        }
    });
    Geometry { bodies: bodies.collect(), meshes, contacts: None }
}

/// Returns the items of a body, in order.
fn of_body<T: Clone>(body: usize, all: &[(usize, T)]) -> Vec<T> {
    all.iter().filter(|(of, _)| *of == body).map(|(_, value)| value.clone()).collect()
}

/// Returns one row of a field that has N values per object.
fn row<T: Copy, const N: usize>(field: &[T], index: usize) -> [T; N] {
    std::array::from_fn(|column| field[N * index + column])
}

/// Returns the joints with their bodies. `reference` is the position of the joint in the drawn model.
fn joints(arm: &Arm, fields: &Fields) -> Vec<(usize, Joint)> {
    let (kinds, bodies, first) = (fields.ints("jnt_type"), fields.ints("jnt_bodyid"), fields.ints("jnt_qposadr"));
    let (axes, anchors, references) = (fields.reals("jnt_axis"), fields.reals("jnt_pos"), fields.reals("qpos0"));
    let joint = |j: usize| {
        // MuJoCo has no fifth kind.
        let kind = JOINTS.get(kinds[j] as usize).copied().unwrap_or(JointKind::Free);
        let joint = Joint {
            name: arm.joint_name(j, kinds[j], bodies[j]),
            kind,
            axis: row(&axes, j),
            position: row(&anchors, j),
            reference: matches!(kind, JointKind::Slide | JointKind::Hinge).then(|| references[first[j] as usize]),
            svv: None,
        };
        (bodies[j] as usize, joint)
    };
    (0..kinds.len()).map(joint).collect()
}

/// Returns the visible shapes with their bodies, and the meshes for drawing them. A shape without triangles is drawn as its bounding box,
/// whose half lengths are its size.
fn shapes(fields: &Fields, triangles: impl FnOnce(&[i32]) -> Vec<Option<Mesh>>) -> (Vec<(usize, Shape)>, Vec<Mesh>) {
    let (kinds, bodies, groups) = (fields.ints("geom_type"), fields.ints("geom_bodyid"), fields.ints("geom_group"));
    let numbers = fields.ints("geom_dataid");
    let (sizes, positions, turns) = (fields.reals("geom_size"), fields.reals("geom_pos"), fields.reals("geom_quat"));
    let (materials, colours, of_materials) = (fields.ints("geom_matid"), fields.floats("geom_rgba"), fields.floats("mat_rgba"));
    let shown: Vec<usize> = (0..kinds.len()).filter(|g| groups[*g] < GROUPS_SHOWN).collect();
    let (drawn_by, meshes) = meshes_of(shown.iter().filter(|g| kinds[**g] == MESH).map(|g| (*g, numbers[*g])).collect(), triangles);
    let shape = |g: usize| {
        let mesh = drawn_by.get(&g).copied();
        let own: [f32; 4] = row(&colours, g);
        let of_material = || Some(row(of_materials.chunks_exact(4).nth(usize::try_from(materials[g]).ok()?)?, 0));
        let shape = Shape {
            kind: if mesh.is_some() { "mesh" } else { SHAPES.get(kinds[g] as usize).copied().unwrap_or("?") }.to_owned(),
            size: row(&sizes, g),
            position: row(&positions, g),
            quaternion: row(&turns, g),
            rgba: if own == COLOUR_DEFAULT { of_material().unwrap_or(own) } else { own },
            mesh,
        };
        (bodies[g] as usize, shape)
    };
    (shown.into_iter().map(shape).collect(), meshes)
}

/// Returns the index of the mesh with which each shape is drawn, given the numbers of the shapes' meshes in the model; also returns the
/// meshes.
fn meshes_of(shapes: Vec<(usize, i32)>, triangles: impl FnOnce(&[i32]) -> Vec<Option<Mesh>>) -> (BTreeMap<usize, usize>, Vec<Mesh>) {
    let mut asked: Vec<i32> = shapes.iter().map(|(_, number)| *number).collect();
    asked.sort_unstable();
    asked.dedup();
    let (mut given, mut meshes) = (BTreeMap::new(), Vec::new());
    for (number, mesh) in asked.iter().zip(triangles(&asked)) {
        if let Some(mesh) = mesh {
            given.insert(*number, meshes.len());
            meshes.push(mesh);
        }
    }
    (shapes.into_iter().filter_map(|(shape, number)| Some((shape, *given.get(&number)?))).collect(), meshes)
}
