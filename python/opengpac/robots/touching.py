# SPDX-License-Identifier: Apache-2.0
"""Contacts between a simulated arm's links, which explain why a joint did not follow."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def touching(model: Path, pose: Mapping[str, float]) -> list[tuple[str, str]]:
    """Returns the pairs of bodies in contact in a pose but not at the model's home, by their names.

    `pose` contains positions of joints, rad or m; all others are at home. Freely moving bodies are excluded, because their positions
    are unknown.
    """
    mujoco: Any = importlib.import_module("mujoco")
    of = mujoco.MjModel.from_xml_path(str(model))
    data = mujoco.MjData(of)
    if of.nkey and (home := mujoco.mj_name2id(of, mujoco.mjtObj.mjOBJ_KEY, "home")) >= 0:
        mujoco.mj_resetDataKeyframe(of, data, home)
    at_home = _pairs(mujoco, of, data)
    for name, position in pose.items():
        joint = mujoco.mj_name2id(of, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint >= 0:
            data.qpos[of.jnt_qposadr[joint]] = position
    return sorted(_pairs(mujoco, of, data) - at_home)


def _pairs(mujoco: Any, model: Any, data: Any) -> set[tuple[str, str]]:
    mujoco.mj_forward(model, data)
    free = {int(body) for body, kind in zip(model.jnt_bodyid, model.jnt_type, strict=True) if kind == mujoco.mjtJoint.mjJNT_FREE}
    pairs = set[tuple[str, str]]()
    for contact in data.contact:
        bodies = [int(model.geom_bodyid[geom]) for geom in contact.geom]
        if free.isdisjoint(int(model.body_rootid[body]) for body in bodies):
            first, second = sorted(_called(model, int(geom), body) for geom, body in zip(contact.geom, bodies, strict=True))
            pairs.add((first, second))
    return pairs


def _called(model: Any, geom: int, body: int) -> str:
    """Returns the name of a body; for a static shape, the shape's own name if it has one."""
    return str((model.body(body).name if body else model.geom(geom).name) or ("the world" if body == 0 else f"body {body}"))
