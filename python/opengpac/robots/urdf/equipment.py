# SPDX-License-Identifier: Apache-2.0
"""Equipment that URDF cannot describe, added to MuJoCo's model: motors, the flange, a home, and pairs that do not collide."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .selection import Selection
from .source import Source


def stand_still(mujoco: Any, spec: Any, selected: Selection) -> None:
    """Locks the stationary joints at their home."""
    for equality in [equality for equality in spec.equalities if equality.name1 in selected.still]:
        spec.delete(equality)
    for joint in [joint for joint in spec.joints if joint.name in selected.still]:
        body, position = joint.parent, selected.home.get(joint.name, 0.0)
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        turned = np.zeros(4)
        if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
            mujoco.mju_rotVecQuat(turned[:3], axis * position, body.quat)
            body.pos += turned[:3]
        else:
            turn = np.zeros(4)
            mujoco.mju_axisAngle2Quat(turn, axis, position)
            mujoco.mju_mulQuat(turned, body.quat, turn)
            body.quat = turned
        spec.delete(joint)


def add_motors(mujoco: Any, spec: Any, selected: Selection) -> None:
    """Adds a motor for each actuated joint, and the site `tool` at the tip of the arm, by default at the flange of the last joint."""
    moving = [joint for joint in spec.joints if joint.name in selected.motors]
    for joint in moving:
        spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    own = [joint for joint in moving if not selected.arm or joint.name in selected.arm]
    if selected.tip:
        spec.body(selected.tip).add_site(name="tool")
    elif own:
        _flange(own[-1].parent).add_site(name="tool")


def add_home(mujoco: Any, spec: Any, model: Any, home: Mapping[str, float]) -> None:
    """Adds the keyframe `home`: these positions, the matching positions of mimic joints, and 0 for all other joints."""
    positions = model.qpos0.copy()
    places = {model.joint(j).name: int(model.jnt_qposadr[j]) for j in range(model.njnt)}
    for name, position in home.items():
        if name in places:
            positions[places[name]] = position
    for equality in range(model.neq):
        if model.eq_type[equality] == mujoco.mjtEq.mjEQ_JOINT and model.eq_obj2id[equality] >= 0:
            follower, leader = (int(model.jnt_qposadr[ids[equality]]) for ids in (model.eq_obj1id, model.eq_obj2id))
            positions[follower] = np.polyval(model.eq_data[equality][4::-1], positions[leader])
    spec.add_key(name="home", qpos=positions)


def collide(spec: Any, source: Source, pairs: list[tuple[str, str]] | None) -> None:
    """Configures the collisions of shapes: with the surroundings only, or, if `pairs` lists the links that do not collide, with each
    other too.

    Shapes are convex hulls: those of links that never touch may overlap during a motion.
    """
    if pairs is not None:
        from ..mjcf import survey  # it imports MuJoCo

        for first, second in pairs:
            spec.add_exclude(bodyname1=first, bodyname2=second)
        for note in survey.exclude_touching(spec, spec.compile()):
            source.note(note)
        return
    for shape in spec.geoms:
        if shape.contype or shape.conaffinity:
            shape.contype, shape.conaffinity = 1, 0


def tell_weak(source: Source, model: Any) -> None:
    """Notes the joints whose motor cannot hold the arm at its home. These notes are placed first, because a warning shows only the first
    ones."""
    from ..mjcf import survey  # it imports MuJoCo

    source.notes[:0] = [f"{source.file.name}: {note}" for note in survey.too_weak(model)]


def _flange(body: Any) -> Any:
    """Returns the last link in the chain of fixed links after the last joint; if the chain branches, the link of the joint itself."""
    last = body
    while len(last.bodies) == 1 and not last.bodies[0].joints:
        last = last.bodies[0]
    return body if last.bodies else last
