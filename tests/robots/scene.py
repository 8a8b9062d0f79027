# SPDX-License-Identifier: Apache-2.0
"""The model of an arm's file, apart from its simulation: touching links in a pose, free paths, and a picture."""

from __future__ import annotations

import importlib
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from opengpac.robots import mjcf, urdf

mujoco: Any = importlib.import_module("mujoco")

SAMPLES = 20
"""Number of poses on a straight path in which links are checked."""
SIZE, QUALITY, PAPER = 320, 70, 244
"""Width and height of a picture in pixels, its WebP quality, and the grey behind the arm."""
AZIMUTH, ELEVATION, MARGIN = 130, -20, 1.03
"""Direction of the camera, degrees, and the margin around the arm."""
PLANE = 0
"""`mjtGeom` of a floor."""


class Scene:
    """Arm and its surroundings. `joints` names the joints to which poses apply."""

    def __init__(self, file: Path, joints: Sequence[str]) -> None:
        if urdf.is_urdf(file):
            text: str | None = urdf.convert(file).text
        else:
            text, _, _ = mjcf.put_right(file)
        self.model = mujoco.MjModel.from_xml_path(str(file)) if text is None else mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.places = [self.model.jnt_qposadr[self.model.joint(name).id] for name in joints]

    @property
    def step_s(self) -> float:
        """Time step of the model, s."""
        return float(self.model.opt.timestep)

    def touching(self, pose: Sequence[float]) -> set[tuple[str, str]]:
        """Returns the pairs of links that touch each other in a pose."""
        self._pose(pose)
        return {tuple(sorted(self._called(geom) for geom in contact.geom)) for contact in self.data.contact}

    def is_free(self, start: np.ndarray, goal: np.ndarray) -> bool:
        """Returns whether the straight path to a goal is free of contacts other than those at its start."""
        at_start = self.touching(start)
        return all(self.touching(start + share * (goal - start)) <= at_start for share in np.linspace(0.0, 1.0, SAMPLES))

    def paint(self, pose: Sequence[float], picture: Path) -> None:
        """Writes a picture of the arm in a pose, from the front, the right and above; none if the arm has no shapes."""
        image = importlib.import_module("PIL.Image")
        model = self.model
        self._pose(pose)
        if model.nlight == 0:
            model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.5, 0.6
        model.geom_rgba[model.geom_type == PLANE, 3] = 0.0
        shown = [geom for geom in range(model.ngeom) if model.geom_type[geom] != PLANE and model.geom_group[geom] < 3]
        if not shown:
            return
        centres, reach = self.data.geom_xpos[shown], model.geom_rbound[shown, None]
        low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
        camera = mujoco.MjvCamera()
        camera.lookat[:], camera.azimuth, camera.elevation = (low + high) / 2, AZIMUTH, ELEVATION
        camera.distance = distance((high - low) / 2, float(model.vis.global_.fovy))
        with mujoco.Renderer(model, SIZE, SIZE) as renderer:
            renderer.update_scene(self.data, camera)
            pixels = renderer.render().copy()
            renderer.enable_segmentation_rendering()
            renderer.update_scene(self.data, camera)
            pixels[renderer.render()[..., 0] < 0] = PAPER
        picture.parent.mkdir(parents=True, exist_ok=True)
        image.fromarray(pixels).save(picture, quality=QUALITY, method=6)

    def _pose(self, pose: Sequence[float]) -> None:
        self.data.qpos[self.places] = pose
        mujoco.mj_forward(self.model, self.data)

    def _called(self, geom: int) -> str:
        """Returns the name of a shape's link, or its own name if it belongs to no link."""
        body = self.model.geom_bodyid[geom]
        return self.model.body(body).name if body else self.model.geom(geom).name or "world"


def distance(half: np.ndarray, field: float) -> float:
    """Returns the distance from the centre of a box at which the camera sees all of its corners.

    `half` has half the lengths of its edges, m; `field` is the vertical field of view, degrees, of a square picture.
    """
    across, up = np.radians(AZIMUTH), np.radians(ELEVATION)
    forward = np.array([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)])
    right = np.array([np.sin(across), -np.cos(across), 0.0])
    corners = half * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    aside = np.abs(np.stack([corners @ right, corners @ np.cross(right, forward)])).max(axis=0)
    return float((MARGIN * aside / np.tan(np.radians(field / 2)) - corners @ forward).max())
