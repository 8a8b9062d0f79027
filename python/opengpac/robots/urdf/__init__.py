# SPDX-License-Identifier: Apache-2.0
"""Arms that are described in URDF, as MJCF models with motors.

MuJoCo reads the file. Before, what other people's files have and MuJoCo refuses is put right, each with a note (`cleaning`, `meshes`).
After, what URDF cannot say is added: a motor for each joint, and a site `tool` at the flange.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ...errors import DeviceFailed, refuse
from . import cleaning, meshes, packages
from .source import Source

MASS_MIN = 1e-3
"""Mass of a moving link of which the file says none, and that has no shape to take it from, kg."""
INERTIA_MIN = 1e-6
"""The least moment of inertia of a moving link, kg.m^2."""


@dataclass(frozen=True)
class Converted:
    """An arm's URDF file, converted.

    `text` is the MJCF model, `speeds` the maximum speed of each joint that has one (rad/s or m/s), `notes` what was put right, one
    sentence each, `held_back` the joints with dry friction and those that others follow.
    """

    text: str
    speeds: dict[str, float]
    notes: tuple[str, ...]
    held_back: frozenset[str]


def is_urdf(file: Path) -> bool:
    """Whether a file is called so, or begins as one."""
    if file.suffix in (".urdf", ".xacro"):
        return True
    try:
        _, root = next(ElementTree.iterparse(file, events=("start",)))
    except (OSError, ElementTree.ParseError, StopIteration):
        return False
    return root.tag == "robot"


def convert(file: Path, package_paths: Iterable[Path] = ()) -> Converted:
    """Converts a URDF file; packages are looked for in `package_paths` first.

    Raises `DeviceFailed` where MuJoCo cannot read what is left.
    """
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        refuse(DeviceFailed, "the Python package 'mujoco' is not installed", "pip install 'opengpac[mujoco]'")
    source = Source.read(file)
    speeds = cleaning.clean(source)
    held_back = frozenset(mimic.get("joint", "") for mimic in source.root.findall("joint/mimic")) | {
        joint.get("name", "")
        for joint in source.root.findall("joint")
        for dynamics in joint.findall("dynamics")
        if dynamics.get("friction")
    }
    meshes.place(source, packages.Packages(file, package_paths))
    try:
        spec = _compiled(mujoco, source)
    except (ValueError, OSError, mujoco.FatalError) as error:
        refuse(DeviceFailed, f"MuJoCo cannot read the URDF file '{file}': {error}", "mend what it names, or give the arm as MJCF")
    return Converted(_balanced(spec.to_xml()), speeds, tuple(source.notes), held_back)


def _balanced(text: str) -> str:
    """The model, to be read with `balanceinertia`, which MuJoCo does not write: inertias of URDF files break A + B >= C by rounding."""
    root = ElementTree.fromstring(text)
    compiler = root.find("compiler")
    if compiler is None:
        compiler = ElementTree.SubElement(root, "compiler")
    compiler.set("balanceinertia", "true")
    return ElementTree.tostring(root, encoding="unicode")


def _compiled(mujoco: Any, source: Source) -> Any:
    """The model, compiled: meshes that MuJoCo cannot use are left out one by one."""
    while True:
        spec = mujoco.MjSpec.from_string(source.text())
        spec.compiler.fusestatic = False
        spec.compiler.balanceinertia = True
        spec.compiler.boundmass, spec.compiler.boundinertia = MASS_MIN, INERTIA_MIN
        _equip(mujoco, spec, source)
        try:
            spec.compile()
            return spec
        except ValueError as error:
            if not meshes.leave_out(source, str(error)):
                raise


def _equip(mujoco: Any, spec: Any, source: Source) -> None:
    """Adds motors and the flange's site. Shapes collide with what is around the arm, not with each other."""
    for shape in spec.geoms:
        if shape.contype or shape.conaffinity:
            shape.contype, shape.conaffinity = 1, 0
    kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    moving = [joint for joint in spec.joints if joint.type in kinds and joint.name not in source.followers]
    for joint in moving:
        spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    if moving:
        _flange(moving[-1].parent).add_site(name="tool")


def _flange(body: Any) -> Any:
    """The last link of a chain of fixed links behind the last joint; where it branches, the link of the joint itself."""
    last = body
    while len(last.bodies) == 1 and not last.bodies[0].joints:
        last = last.bodies[0]
    return body if last.bodies else last
