# SPDX-License-Identifier: Apache-2.0
"""Arms that are described in URDF: MuJoCo reads the file; what its MJCF says besides is added here.

URDF has no actuators, so each joint gets a motor of the effort that its limit says. A flange that is a link without joints
is kept as a body with the site `tool`. MuJoCo does not take over the limits of speed; they are read from the file.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ..errors import DeviceFailed, refuse


def is_urdf(file: Path) -> bool:
    """Whether a file is called so, or begins as one."""
    if file.suffix == ".urdf":
        return True
    try:
        _, root = next(ElementTree.iterparse(file, events=("start",)))
    except (OSError, ElementTree.ParseError, StopIteration):
        return False
    return root.tag == "robot"


def speed_limits(file: Path) -> dict[str, float]:
    """The maximum speed of each joint that has one, rad/s (m/s)."""
    limits = {joint.get("name", ""): joint.find("limit") for joint in ElementTree.parse(file).getroot().findall("joint")}
    speeds = {name: float(limit.get("velocity", 0.0)) for name, limit in limits.items() if limit is not None}
    return {name: speed for name, speed in speeds.items() if speed > 0.0}


def mjcf(file: Path) -> str:
    """A URDF file as the text of an MJCF model with motors. Refused with `DeviceFailed` where MuJoCo cannot read it."""
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        refuse(DeviceFailed, "the Python package 'mujoco' is not installed", "pip install 'opengpac[mujoco]'")
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        _place_meshes(spec, file)
        spec.compiler.fusestatic = False
        moving = [joint for joint in spec.joints if joint.type in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)]
        for joint in moving:
            spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        if moving:
            _flange(moving[-1].parent).add_site(name="tool")
        spec.compile()
        return spec.to_xml()
    except (ValueError, OSError, mujoco.FatalError) as error:
        remedy = "meshes are looked for beside it, or where <mujoco><compiler meshdir=…/></mujoco> in it says"
        refuse(DeviceFailed, f"MuJoCo cannot read the URDF file '{file}': {error}", remedy)


def _place_meshes(spec: Any, file: Path) -> None:
    """Meshes by their whole paths, so that the model may lie anywhere. URDF names them by packages, which nobody here knows."""
    folder = file.parent / spec.meshdir
    for mesh in spec.meshes:
        name = mesh.file.removeprefix("package://")
        whole = folder / name
        mesh.file = str(whole if whole.exists() else folder / Path(name).name)
    spec.strippath = False


def _flange(body: Any) -> Any:
    """The last link of a chain of fixed links behind the last joint; where it branches, the link of the joint itself."""
    last = body
    while len(last.bodies) == 1 and not last.bodies[0].joints:
        last = last.bodies[0]
    return body if last.bodies else last
