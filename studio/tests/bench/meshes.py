# SPDX-License-Identifier: Apache-2.0
"""An arm that sways, with a dense mesh on each of its bodies, for `meshes.test.ts`. OPENGPAC_TRIANGLES: of all together."""

import os
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from opengpac.robots import Joint

SWAY = gpac.Verb(
    "sway",
    blocks={"wave": lib.signal_generator},
    objects={"joint": Joint},
    instantiation_parameters={"joint.commanded": "wave.y"},
    input_parameters={"place": "wave.offset", "amplitude": "wave.amplitude", "frequency": "wave.frequency"},
    command_lists={"start": [activate("wave", every="20 ms")]},
)
STEP_S = 0.02


def ball(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of an ellipsoid of about so many triangles."""
    rings = max(3, round((triangles / 4) ** 0.5))
    around = 2 * rings
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, around, endpoint=False), indexing="ij")
    place = [0.05 * np.sin(polar) * np.cos(azimuth), 0.05 * np.sin(polar) * np.sin(azimuth), 0.09 * np.cos(polar)]
    corner = np.arange((rings + 1) * around).reshape(rings + 1, around)
    here, there = corner, np.roll(corner, -1, axis=1)
    quads = np.stack([here[:-1], here[1:], there[1:], there[:-1]], axis=-1).reshape(-1, 4)
    return np.stack(place, axis=-1).reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def meshed(triangles: int) -> Path:
    """The UR5e with them."""
    spec = mujoco.MjSpec.from_file(str(Path(gpac.__file__).parent / "robots/ur5e.xml"))
    bodies = [body for body in spec.bodies if body.name != "world"]
    vertices, faces = ball(triangles // len(bodies))
    for number, body in enumerate(bodies):
        spec.add_mesh(name=f"dense{number}", uservert=vertices.ravel().tolist(), userface=faces.ravel().tolist())
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"dense{number}", mass=0, contype=0, conaffinity=0, rgba=[0.4, 0.6, 0.8, 1])
    file = Path(tempfile.mkdtemp()) / "meshed.xml"
    spec.compile()
    file.write_text(spec.to_xml())
    return file


cell = gpac.System("meshed", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
slow = rtp.timer("slow", period="20 ms", priority=60)
arm = gpac.robots.load(meshed(int(os.environ.get("OPENGPAC_TRIANGLES", "40000"))), rtp, on=fast)
arm.enable()
for joint in (arm["shoulder_pan"], arm["wrist_1"]):
    SWAY.on(slow).asynch(joint, place=joint.sensed.value, amplitude=0.4, frequency=0.25)
while True:
    cell.advance(STEP_S)
    time.sleep(STEP_S)
