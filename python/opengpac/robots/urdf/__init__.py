# SPDX-License-Identifier: Apache-2.0
"""Converts arms described in URDF to MJCF models with motors.

MuJoCo reads the file. First, common defects that MuJoCo rejects are corrected, each with a note (`cleaning`, `meshes`). Afterwards,
data that URDF cannot express are added: a motor for each joint, a site `tool` at the flange, and the contents of an SRDF file
(`srdf`).
"""

from __future__ import annotations

import importlib
import itertools
import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree

from ...errors import DeviceFailed, refuse
from . import cleaning, control, equipment, meshes, packages, selection, srdf
from .control import Interfaces as Interfaces
from .encoding import root_tag
from .source import Source as Source

_logger = logging.getLogger("opengpac")

MASS_MIN = 1e-3
"""Mass of a moving link that has neither a specified mass nor a shape from which to compute it, kg."""
INERTIA_MIN = 1e-6
"""Minimum moment of inertia of a moving link, kg.m^2."""
JOINTS_TOLD = 5
"""Maximum number of joints that a refusal lists."""


@dataclass(frozen=True)
class ConvertedArm:
    """An arm's URDF file, converted.

    `text` is the MJCF model, `speeds` the maximum speed of each joint that has one (rad/s or m/s), `notes` the corrections, one
    sentence each, `held_back` the joints with dry friction or mimic joints, `joints` those of the selected group (empty without one),
    `groups` and `states` those of the SRDF file, `interfaces` the declarations of joints in `ros2_control` tags.
    """

    text: str
    speeds: dict[str, float]
    notes: tuple[str, ...]
    held_back: frozenset[str]
    joints: frozenset[str]
    groups: Mapping[str, tuple[str, ...]]
    states: Mapping[str, Mapping[str, float]]
    interfaces: Mapping[str, Interfaces]


def is_urdf(file: Path) -> bool:
    """Returns whether a file is URDF, judging by its name or its first bytes."""
    return file.suffix in (".urdf", ".xacro") or root_tag(file) == "robot"


def convert(
    file: Path,
    package_paths: Iterable[Path] = (),
    semantic: Path | bool = False,
    group: str | None = None,
    self_collision: bool = False,
) -> ConvertedArm:
    """Converts a URDF file; `package_paths` is searched for packages first.

    `semantic` is its SRDF file, or whether to read the one next to it; `group` is the group in that file whose joints form the arm;
    `self_collision` specifies whether its links collide with each other, except for neighbours and the pairs that the SRDF file
    excludes. Raises `DeviceFailed` if MuJoCo cannot read the result, `UnknownName` for a group that the SRDF file lacks.
    """
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        refuse(DeviceFailed, "the Python package 'mujoco' is not installed", "run pip install 'opengpac[mujoco]'")
    found = packages.Packages(file, package_paths)
    source = Source.read(file, found)
    controls = control.read(source)
    speeds = cleaning.clean(source)
    control.narrow(source, controls, speeds)
    semantics = _semantics(source, semantic, found)
    selected = selection.select(source, semantics, controls.home, group)
    if not selected.motors:
        _refuse_still(source)
    held_back = frozenset(mimic.get("joint", "") for mimic in source.root.findall("joint/mimic")) | {
        joint.get("name", "")
        for joint in source.root.findall("joint")
        for dynamics in joint.findall("dynamics")
        if dynamics.get("friction")
    }
    meshes.place(source, found)
    try:
        spec = _compiled(mujoco, source, selected, semantics.pairs if self_collision else None)
    except (ValueError, OSError, mujoco.FatalError) as error:
        refuse(DeviceFailed, f"MuJoCo cannot read the URDF file '{file}': {error}", "fix the file, or load the arm as MJCF")
    states = semantics.states_of(selected.arm or selected.motors)
    return ConvertedArm(
        _balanced(spec.to_xml()), speeds, tuple(source.notes), held_back, selected.arm, semantics.groups, states, controls.interfaces
    )


def _refuse_still(source: Source) -> NoReturn:
    """Refuses a file without a joint that a motor could move, and gives the reason for each joint."""
    joints = source.root.findall("joint")
    if not joints:
        source.refuse(source.root, "the robot has no joints", "add a revolute, continuous or prismatic joint")
    ranges = [note for note in source.notes if "is fixed there" in note]
    kinds = {"fixed": "is fixed", "floating": "is floating", "planar": "is planar"}
    named = (f"'{joint.get('name')}' {kinds.get(joint.get('type', ''), 'follows another joint or is passive')}" for joint in joints)
    reasons = "; ".join([*ranges[:JOINTS_TOLD]] or [*itertools.islice(named, JOINTS_TOLD)])
    source.refuse(joints[0], f"no joint of the robot can move: {reasons}", "define a range whose upper limit is above the lower one")


def _semantics(source: Source, semantic: Path | bool, packages: packages.Packages) -> srdf.Semantics:
    """Returns the semantics from the SRDF file that is passed, or found next to the URDF file, and logs which file it is.

    An invalid file that was only found is ignored with a note, because it was not requested.
    """
    if isinstance(semantic, Path):
        return srdf.read(semantic, source, packages)
    found = srdf.beside(source.file) if semantic else []
    if len(found) > 1:
        names = ", ".join(f"'{file.name}'" for file in found)
        _logger.info(
            "'%s': none of the SRDF files beside it (%s) is read, because there are several; choose one with srdf=", source.file.name, names
        )
    if len(found) != 1:
        return srdf.Semantics()
    try:
        semantics = srdf.read(found[0], source, packages)
    except DeviceFailed as error:
        source.note(f"the SRDF file beside it is ignored: {error.message}")
        return srdf.Semantics()
    groups = ", ".join(semantics.groups) or "none"
    _logger.info("'%s': read the SRDF file beside it, '%s', with the groups %s", source.file.name, found[0], groups)
    return semantics


def _balanced(text: str) -> str:
    """Returns the model with the attribute `balanceinertia`, which MuJoCo does not write. It is needed because inertias in URDF files
    violate A + B >= C by rounding."""
    root = ElementTree.fromstring(text)
    compiler = root.find("compiler")
    if compiler is None:
        compiler = ElementTree.SubElement(root, "compiler")
    compiler.set("balanceinertia", "true")
    return ElementTree.tostring(root, encoding="unicode")


def _compiled(mujoco: Any, source: Source, selected: selection.Selection, pairs: list[tuple[str, str]] | None) -> Any:
    """Returns the compiled model; removes unusable meshes one by one."""
    while True:
        spec = mujoco.MjSpec.from_string(source.text())
        spec.compiler.fusestatic = False
        spec.compiler.balanceinertia = True
        spec.compiler.boundmass, spec.compiler.boundinertia = MASS_MIN, INERTIA_MIN
        equipment.stand_still(mujoco, spec, selected)
        equipment.add_motors(mujoco, spec, selected)
        try:
            model = spec.compile()
            break
        except ValueError as error:
            if not meshes.leave_out(source, str(error)):
                raise
    if any(name not in selected.still for name in selected.home):
        equipment.add_home(mujoco, spec, model, selected.home)
    equipment.collide(spec, source, pairs)
    equipment.tell_weak(source, spec.compile())
    return spec
