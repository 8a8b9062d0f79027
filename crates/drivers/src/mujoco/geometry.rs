// SPDX-License-Identifier: Apache-2.0
//! The bodies of a model for drawing: where each is on its parent, how it moves, its shapes. What only collides, group 3 and above
//! as MuJoCo's own viewer hides it, is left out.
use super::library::object;
use super::model::{Arm, Fields};
use serde_json::{Value, json};

/// Groups of shapes that are shown.
const GROUPS_SHOWN: i32 = 3;
/// What a shape's colour is where the model does not give it one of its own.
const COLOUR_DEFAULT: [f32; 4] = [0.5, 0.5, 0.5, 1.0];
/// `mjtGeom`, by number; a mesh is shown as a box.
const SHAPES: [&str; 9] = ["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "box", "sdf"];
/// `mjtJoint`, by number.
const JOINTS: [&str; 4] = ["free", "ball", "slide", "hinge"];

/// `{"bodies": […], "meshes": []}`: metres, quaternions w x y z, in the order of the model; the first body is the world.
pub(super) fn geometry(arm: &Arm, fields: &Fields) -> Value {
    let (parents, positions, turns) = (fields.ints("body_parentid"), fields.reals("body_pos"), fields.reals("body_quat"));
    let name = |body: usize| arm.name(object::BODY, body as i32).unwrap_or_else(|| format!("body_{body}"));
    let joints = joints(arm, fields);
    let shapes = shapes(fields);
    let bodies = (0..parents.len()).map(|body| {
        let of = |all: &[(usize, Value)]| all.iter().filter(|(of, _)| *of == body).map(|(_, value)| value.clone()).collect::<Vec<_>>();
        let joints = of(&joints);
        json!({
            "name": name(body), "parent": (body > 0).then(|| name(parents[body] as usize)),
            "position": positions[3 * body..3 * body + 3], "quaternion": turns[4 * body..4 * body + 4],
            "joint": joints.first(), "joints": joints, "geoms": of(&shapes),
        })
    });
    json!({ "bodies": bodies.collect::<Vec<_>>(), "meshes": [] })
}

/// The joints with their bodies. `reference`: the position at which the body stands as the model has drawn it.
fn joints(arm: &Arm, fields: &Fields) -> Vec<(usize, Value)> {
    let (kinds, bodies, first) = (fields.ints("jnt_type"), fields.ints("jnt_bodyid"), fields.ints("jnt_qposadr"));
    let (axes, anchors, references) = (fields.reals("jnt_axis"), fields.reals("jnt_pos"), fields.reals("qpos0"));
    let joint = |j: usize| {
        let kind = JOINTS.get(kinds[j] as usize).copied().unwrap_or("?");
        let reference = matches!(kind, "slide" | "hinge").then(|| references[first[j] as usize]);
        let described = json!({
            "name": arm.name(object::JOINT, j as i32).unwrap_or_else(|| format!("joint_{j}")), "kind": kind,
            "axis": axes[3 * j..3 * j + 3], "position": anchors[3 * j..3 * j + 3], "reference": reference,
        });
        (bodies[j] as usize, described)
    };
    (0..kinds.len()).map(joint).collect()
}

/// The shapes that are shown with their bodies. The triangles of a mesh are not among the fields that MuJoCo gives by their names: it is
/// drawn as the box around it, whose half lengths are its size.
fn shapes(fields: &Fields) -> Vec<(usize, Value)> {
    let (kinds, bodies, groups) = (fields.ints("geom_type"), fields.ints("geom_bodyid"), fields.ints("geom_group"));
    let (sizes, positions, turns) = (fields.reals("geom_size"), fields.reals("geom_pos"), fields.reals("geom_quat"));
    let (materials, colours, of_materials) = (fields.ints("geom_matid"), fields.floats("geom_rgba"), fields.floats("mat_rgba"));
    let shape = |g: usize| {
        let own = &colours[4 * g..4 * g + 4];
        let of_material = usize::try_from(materials[g]).ok().and_then(|m| of_materials.get(4 * m..4 * m + 4));
        let colour = if own == COLOUR_DEFAULT { of_material.unwrap_or(own) } else { own };
        let described = json!({
            "kind": SHAPES.get(kinds[g] as usize).copied().unwrap_or("?"), "size": sizes[3 * g..3 * g + 3], "position": positions[3 * g..3 * g + 3],
            "quaternion": turns[4 * g..4 * g + 4], "rgba": colour, "mesh": null,
        });
        (bodies[g] as usize, described)
    };
    (0..kinds.len()).filter(|g| groups[*g] < GROUPS_SHOWN).map(shape).collect()
}
