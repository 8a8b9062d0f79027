# SPDX-License-Identifier: Apache-2.0
"""Computes the frame of a tool from poses in which its tip touches one point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import CallError, ValueRefused, refuse
from ..values.frames import Pose
from .arm import Arm

LEAST = 4
"""Minimum number of poses; with three, the residual would not reveal a wrong pose."""

SPREAD = 0.1
"""Minimum for the smallest singular value of the rotations: about 20 degrees between the poses about the axis that varies least."""


@dataclass(frozen=True)
class TouchedTool:
    """Tool centre point found by `tool_by_touching`, and the consistency of the poses.

    `frame`: the tool in the flange's frame, with the orientation of the flange; `tip`: the touched point, m; `residuals`: for each
    pose, the distance of its tip from that point, m; `residual`: their root mean square; `spread`: 0 to 1, a measure of the variation
    of orientation; an error in a pose is amplified by about 1/spread in the frame.
    """

    frame: Pose
    tip: np.ndarray
    residuals: np.ndarray
    residual: float
    spread: float


def tool_by_touching(
    arm: Arm,
    points: Iterable[Mapping[str, float] | Sequence[float] | np.ndarray],
    *,
    orientation: Sequence[Any] = (0.0, 0.0, 0.0),
    residual_max: float = 0.002,
) -> TouchedTool:
    """Finds the tool centre point of an `arm` from 4 or more poses in which the tip of the tool touches one point.

    `points` are taught points, or the positions of all joints in each pose; `orientation` is roll, pitch and yaw of the tool in the
    flange's frame; `residual_max` is in m. Solves place + turn · frame = tip by least squares; ignores the arm's current tool. Raises
    `ValueRefused` if the orientations are too similar, or if a tip is further than `residual_max` from the common point; the message
    then names the pose. `arm.tool = tool_by_touching(arm, [points[name] for name in names]).frame`.
    """
    without = arm.tool.inverse()
    poses = [_pose(arm, place, point) @ without for place, point in enumerate(points)]
    if len(poses) < LEAST:
        what = f"{len(poses)} positions are too few"
        refuse(
            CallError, what, f"pass {LEAST} or more at which the tip touches the same point, each with a different orientation of the tool"
        )
    turns, places = np.array([pose.matrix[:3, :3] for pose in poses]), np.array([pose.position for pose in poses])
    # The part common to all poses is the tip's: differences from the mean isolate the tool.
    rows = (turns - turns.mean(axis=0)).reshape(-1, 3) / np.sqrt(len(poses))
    spread = float(np.linalg.svd(rows, compute_uv=False)[-1])
    if spread < SPREAD:
        refuse(
            ValueRefused,
            f"the orientations of the tool at the {len(poses)} positions are too similar (spread {spread:.3f}, minimum {SPREAD})",
            "touch the point from directions that differ by at least 30 degrees, about two axes",
        )
    found = np.linalg.lstsq(rows, -(places - places.mean(axis=0)).ravel() / np.sqrt(len(poses)), rcond=None)[0]
    tips = places + turns @ found
    tip = tips.mean(axis=0)
    residuals = np.linalg.norm(tips - tip, axis=1)
    if residuals.max() > residual_max:
        worst = int(residuals.argmax())
        what = (
            f"the tip at position {worst} (counted from 0) is {residuals[worst]:.3g} m from the common point, more than {residual_max:g} m"
        )
        refuse(ValueRefused, what, "touch the point again there, or pass a larger residual_max")
    residual = float(np.sqrt((residuals**2).mean()))
    return TouchedTool(Pose(tuple(found), rpy=tuple(orientation)), tip, residuals, residual, spread)


def _pose(arm: Arm, place: int, point: Any) -> Pose:
    """Returns the pose of the tool at the point with index `place`; refusals state that index."""
    try:
        return arm.forward(point)
    except (CallError, ValueRefused) as error:
        error.message = f"position {place} (counted from 0): {error.message}"
        raise
