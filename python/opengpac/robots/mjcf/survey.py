# SPDX-License-Identifier: Apache-2.0
"""Checks an MJCF file and prints, as JSON, the model to simulate in its place (null: the file itself) and the changes.

Runs as a program, `python survey.py FILE`, in a separate process, and imports nothing from OpenGPAC.
"""

from __future__ import annotations

import importlib
import json
import os
import re
import resource
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

mujoco: Any = importlib.import_module("mujoco")

POSES = 64
"""Number of poses to check in addition to the home pose."""
TURN, SLIDE = np.pi, 0.5
"""Range to check for a joint without limits: plus and minus this, rad and m."""
ACCELERATION = 5.0
"""Acceleration for which a motor without a limit is sized, for all joints at once, rad/s^2 or m/s^2."""
RESERVE = 2.0
"""Effort of such a motor, as a multiple of the required effort."""
DAMPING_MAX = 1e6
"""Damping above which a joint counts as locked: no motor is added to it."""
MASS_MIN, INERTIA_MIN = 1e-3, 1e-6
"""Mass and moment of inertia of a body whose only shape is removed, kg and kg.m^2."""
SECONDS_MAX = 60
"""Limit on the processor time of one survey, s."""
NUMBER_MAX = 1e10
"""Limit above which MuJoCo itself considers the simulation to have diverged."""
STOP = 1e-3
"""Distance from the end of its range within which a joint is considered to rest on its stop, rad or m."""
_KINDS = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
"""Kinds of joints of an arm. They are plain integers, because NumPy integers are not found in a tuple of MuJoCo's enumerators."""


def main(file: Path, is_whole: bool) -> None:
    """Prints `[text or null, notes, joints that dry friction or mimic joints hold back]`; with `is_whole`, always the text.

    If the model has an impossible number, prints a sentence about it instead.
    """
    spec = mujoco.MjSpec.from_file(str(file))
    model, notes = _compiled(spec)
    if sentence := _impossible(spec, model):
        print(json.dumps(sentence))
        return
    if not any(kind == mujoco.mjtTrn.mjTRN_JOINT for kind in model.actuator_trntype):
        notes += _give_motors(spec, model)
        model = spec.compile()
    notes += exclude_touching(spec, model)
    text = _text(spec, file.parent) if notes or is_whole else None
    print(json.dumps([text, notes + too_weak(model), _held_back(spec, model)]))


def _compiled(spec: Any) -> tuple[Any, list[str]]:
    """Compiles a model. Removes meshes that are missing or that MuJoCo cannot read, one by one, because an arm can move without them."""
    notes: list[str] = []
    while True:
        try:
            return spec.compile(), notes
        except ValueError as error:
            problem = " ".join(str(error).removeprefix("Error: ").split())
            mesh = _blamed(spec, problem)
            if mesh is None:
                raise
            notes.append(f"mesh '{Path(mesh.file).name or mesh.name}' is ignored: {problem}")
            for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
                spec.delete(geom)
            spec.delete(mesh)
            # A body that had its mass of that shape has the least one.
            spec.compiler.boundmass = max(spec.compiler.boundmass, MASS_MIN)
            spec.compiler.boundinertia = max(spec.compiler.boundinertia, INERTIA_MIN)


def _blamed(spec: Any, problem: str) -> Any:
    """Returns the mesh to which a message of MuJoCo refers, by its name or its file; None if the message is about something else."""
    if not re.search("mesh|vert|face|opening file", problem, re.IGNORECASE):
        return None
    named = re.findall(r"'([^']*)'", problem)
    files = {Path(name).name for name in named if Path(name).suffix}
    return next((mesh for mesh in spec.meshes if mesh.name in named or Path(mesh.file).name in files), None)


def _impossible(spec: Any, model: Any) -> str | None:
    """Returns a sentence about a mass or an inertia, computed from sizes and densities, that makes simulation impossible; None if there
    is no such value."""
    for body in spec.bodies:
        if not 0.0 <= model.body_mass[body.id] <= NUMBER_MAX:
            return f"body '{body.name}' has an invalid mass, {model.body_mass[body.id]:g} kg"
        if not np.all(np.abs(model.body_inertia[body.id]) <= NUMBER_MAX):
            return f"body '{body.name}' has an inertia that is not a number, or too large a mass or size"
    return None


def _held_back(spec: Any, model: Any) -> list[str]:
    """Returns the joints with dry friction, and those with mimic joints."""
    led = {equality.name2 for equality in spec.equalities if equality.type == mujoco.mjtEq.mjEQ_JOINT}
    rubs = {joint.name for joint in spec.joints if joint.type in _KINDS and model.dof_frictionloss[model.jnt_dofadr[joint.id]] > 0.0}
    return sorted(name for name in led | rubs if name)


def _text(spec: Any, folder: Path) -> str:
    """Returns the model with absolute file paths, because it is read from another folder."""
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    folders = {"texture": "", "other": ""}
    for compiler in root.iter("compiler"):
        compiler.set("strippath", "false")
        assets = compiler.attrib.pop("assetdir", "")
        folders["texture"] = compiler.attrib.pop("texturedir", assets)
        folders["other"] = compiler.attrib.pop("meshdir", assets)
    for element in root.iter():
        for word in [word for word in element.attrib if word.startswith("file")]:
            place = folders["texture" if element.tag == "texture" else "other"]
            element.set(word, str(folder / place / element.attrib[word]))
    return ElementTree.tostring(root, encoding="unicode")


def _give_motors(spec: Any, model: Any) -> list[str]:
    """Adds a motor to every joint except mimic and locked joints. Removes the constraints by which mocap bodies move other bodies."""
    notes = []
    leaders = {body.name for body in spec.bodies if body.mocap}
    for equality in [equality for equality in spec.equalities if {equality.name1, equality.name2} & leaders]:
        notes.append(f"the file couples '{equality.name1}' and '{equality.name2}' by a mocap body; motors drive the arm instead")
        spec.delete(equality)
    followers = {equality.name1 for equality in spec.equalities if equality.type == mujoco.mjtEq.mjEQ_JOINT and equality.name2}
    efforts, given = _efforts(model), []
    for joint in spec.joints:
        id = joint.id
        if joint.type not in _KINDS or joint.name in followers or not joint.name:
            continue
        if model.dof_damping[model.jnt_dofadr[id]] > DAMPING_MAX:
            notes.append(f"joint '{joint.name}' is locked by its damping, so no motor is added")
            continue
        motor = spec.add_actuator(name=f"motor of {joint.name}", target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        unit = "N.m" if joint.type == mujoco.mjtJoint.mjJNT_HINGE else "N"
        if model.jnt_actfrclimited[id]:
            given.append(f"'{joint.name}' with the limit of the file")
            continue
        motor.forcelimited, motor.forcerange = True, [-efforts[id], efforts[id]]
        given.append(f"'{joint.name}' {efforts[id]:g} {unit}")
    return [*notes, f"no actuator drives a joint, so motors are added: {', '.join(given)}"] if given else []


def _efforts(model: Any) -> Any:
    """Returns for each joint the effort required to hold it against gravity, springs and friction and to accelerate it, with a reserve."""
    data, most = mujoco.MjData(model), np.zeros(model.nv)
    inertia = np.zeros((model.nv, model.nv))
    for _ in _poses(model, data):
        mujoco.mj_fullM(model, data, inertia)
        moved = np.where(model.dof_damping > DAMPING_MAX, 0.0, ACCELERATION)
        most = np.maximum(most, np.abs(data.qfrc_bias) + np.abs(data.qfrc_spring) + np.abs(inertia) @ moved)
    most = RESERVE * (most + model.dof_frictionloss + np.minimum(model.dof_damping, DAMPING_MAX))
    return [float(f"{most[dof]:.2g}") for dof in model.jnt_dofadr]


def _poses(model: Any, data: Any) -> Any:
    """Moves the arm to its home, then to poses distributed evenly over the ranges, and yields the index of each pose."""
    home = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "home")
    mujoco.mj_resetDataKeyframe(model, data, home)
    joints = [j for j in range(model.njnt) if model.jnt_type[j] in _KINDS]
    places = [int(model.jnt_qposadr[j]) for j in joints]
    whole = np.array([TURN if model.jnt_type[j] == _KINDS[0] else SLIDE for j in joints])
    start = data.qpos[places].copy()
    low, high = start - whole, start + whole
    limits = model.jnt_range[joints]
    is_limited = (model.jnt_limited[joints] != 0) & (limits[:, 0] <= limits[:, 1]) if joints else np.zeros(0, bool)
    start = np.where(is_limited, np.clip(start, limits[:, 0], limits[:, 1]), start)
    low, high = np.where(is_limited, limits[:, 0], low), np.where(is_limited, limits[:, 1], high)
    # Fixed seed: a file gives the same result each time.
    shares = np.random.default_rng(1).random((POSES, len(joints)))
    for number, pose in enumerate([start, *(low + (high - low) * shares)]):
        data.qpos[places] = pose
        mujoco.mj_forward(model, data)
        yield number


def exclude_touching(spec: Any, model: Any) -> list[str]:
    """Excludes the pairs of links in contact at home; MuJoCo itself excludes neighbours."""
    driven = {int(model.actuator_trnid[a][0]) for a in range(model.nu) if model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT}
    trees = {int(model.body_treeid[model.jnt_bodyid[j]]) for j in driven}
    data = mujoco.MjData(model)
    next(_poses(model, data))
    # Contacts with an address exert a force.
    touching = {
        tuple(sorted(int(model.geom_bodyid[geom]) for geom in contact.geom)) for contact in data.contact if contact.efc_address >= 0
    }
    notes = []
    for pair in sorted(touching):
        of = {int(model.body_treeid[body]) for body in pair}
        first, second = (model.body(body).name for body in pair)
        # Tree -1 is static. An object that the arm touches is not part of the arm.
        if of & trees and not of - trees - {-1} and first and second:
            spec.add_exclude(bodyname1=first, bodyname2=second)
            notes.append(f"'{first}' and '{second}' touch at the arm's home, so their collisions are ignored")
    return notes


def _limit() -> None:
    """Limits this process to a minute of processor time, and to 8 GiB or half of the machine's memory, whichever is less, as in the
    driver, because sizes in a file may be arbitrary."""
    bytes_max = min(8 << 30, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (bytes_max, bytes_max))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS_MAX, SECONDS_MAX + 1))


def too_weak(model: Any) -> list[str]:
    """Returns notes on the joints that cannot hold the arm at its home because gravity exceeds the effort of their motor, unless they
    rest on a stop.

    Includes joints that cannot move because their dry friction is at least the full effort of their motor.
    """
    data = mujoco.MjData(model)
    next(_poses(model, data))
    notes = []
    for j, most in _strengths(model).items():
        dof, position = model.jnt_dofadr[j], data.qpos[model.jnt_qposadr[j]]
        unit = "N.m" if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE else "N"
        if 0.0 < most <= model.dof_frictionloss[dof]:
            notes.append(
                f"joint '{model.joint(j).name}' cannot move: its dry friction is "
                f"{model.dof_frictionloss[dof]:.3g} {unit}, but its motor has "
                f"only {most:.3g} {unit}; increase the effort or reduce the friction"
            )
            continue
        needed = float(data.qfrc_bias[dof] - data.qfrc_passive[dof])
        # Gravity against a stop needs no motor.
        stop = model.jnt_range[j][0 if needed > 0.0 else 1]
        if abs(needed) > most + model.dof_frictionloss[dof] and not (model.jnt_limited[j] and abs(position - stop) < STOP):
            notes.append(
                f"joint '{model.joint(j).name}' sinks: it needs {abs(needed):.3g} {unit} at the arm's home, but its motor has only "
                f"{most:.3g} {unit}; choose another home, or increase the effort"
            )
    return notes


def _strengths(model: Any) -> dict[int, float]:
    """Returns the maximum effort of each joint with a motor."""
    most: dict[int, float] = {}
    for a in range(model.nu):
        if model.actuator_trntype[a] != int(mujoco.mjtTrn.mjTRN_JOINT):
            continue
        j, gear = int(model.actuator_trnid[a][0]), abs(float(model.actuator_gear[a][0]))
        limits = [np.inf]
        if model.actuator_forcelimited[a]:
            limits.append(float(np.abs(model.actuator_forcerange[a]).max()))
        is_plain = model.actuator_gaintype[a] == mujoco.mjtGain.mjGAIN_FIXED and model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_NONE
        if model.actuator_ctrllimited[a] and is_plain:
            limits.append(float(np.abs(model.actuator_ctrlrange[a]).max() * abs(model.actuator_gainprm[a][0])))
        most[j] = most.get(j, 0.0) + gear * min(limits)
    return {
        j: min(effort, float(np.abs(model.jnt_actfrcrange[j]).max())) if model.jnt_actfrclimited[j] else effort
        for j, effort in most.items()
        if model.jnt_type[j] in _KINDS
    }


if __name__ == "__main__":
    _limit()
    main(Path(sys.argv[1]), "--whole" in sys.argv[2:])
