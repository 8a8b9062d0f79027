# SPDX-License-Identifier: Apache-2.0
"""The joints of an arm move through way-points without stopping at them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import library as lib
from ..commands import activate, execute
from ..conditions import on
from ..decorated import verb
from ..errors import CallError, Terminated, Unreachable, refuse
from ..groups import Group
from ..parameters import each, input
from ..robots.joints import Joint
from ..robots.motion import MotionTimeout, Moved

POINTS_MAX = 64
"""The most way-points of one path."""

JOINTS_MAX = 16
"""The most joints of one path."""


class PathRefused(Terminated, Unreachable):
    """A way-point outside the range of a joint; nothing has moved. `joint` and `point` (from 0) say which."""

    joint: str | None = None
    point: int | None = None

    def explanation(self) -> str:
        """Which way-point and which joint."""
        joint = self.objects["arm"][int(self.value)]
        self.joint, self.point = joint.short_name, int(self.outputs["refused"])
        low, high = joint.position_min, joint.position_max
        range_text = f"{low:.6g} to {high:.6g}"
        return f"way-point {self.point} is outside the range of joint '{self.joint}', {range_text}; are degrees meant? gpac.deg(points)"


def _way_points(given: Any, objects: Mapping[str, Any]) -> Any:
    """A list of way-points as the planner's table: short lists are filled up with their last point, rows with zeros."""
    try:
        points = np.array([list(point) for point in given], dtype=float)
    except (TypeError, ValueError):
        refuse(CallError, f"the way-points are {given!r}", "give a list of joint positions, each a list of numbers in rad")
    joints = len(objects["arm"]) if "arm" in objects else JOINTS_MAX
    if points.ndim != 2 or not 1 <= len(points) <= POINTS_MAX or points.shape[1] != joints:
        refuse(
            CallError, f"the way-points have the shape {points.shape}", f"give 1 to {POINTS_MAX} points of {joints} joint positions each"
        )
    table = np.zeros((POINTS_MAX, JOINTS_MAX))
    table[: len(points), :joints] = points
    table[len(points) :, :joints] = points[-1]
    return table


def _each_point(given: Any, objects: Mapping[str, Any]) -> Any:
    """One value for all way-points, or one for each: filled up with the last."""
    if isinstance(given, int | float | np.number):
        return [float(given)] * POINTS_MAX
    values = list(given)
    if not 1 <= len(values) <= POINTS_MAX:
        refuse(CallError, f"{len(values)} values are given for the way-points", f"give one for all, or 1 to {POINTS_MAX}")
    return values + [values[-1]] * (POINTS_MAX - len(values))


@verb(
    name="follow",
    blocks={
        "planner": lib.block("path_planner"),
        "generator": lib.block("path_generator"),
        "near": lib.block("in_position"),
    },
    objects={"arm": each(Joint)},
    instantiation_parameters={
        "arm.commanded": ["planner.start", "generator.setpoint"],
        "arm.goal": ["planner.target", "near.goal"],
        "arm.sensed": "near.sensed",
    },
    cells={"path": ["planner.path", "generator.path"], "complete": ["generator.complete", "near.complete"]},
    input_parameters={
        "points": input("planner.points", form=_way_points),
        "blend": input("planner.blend", form=_each_point),
        "speed": input("planner.speed", form=_each_point),
        "tolerance": "near.tolerance",
        "arm.max_speed": "planner.speed_max",
        "arm.max_acceleration": ["planner.acceleration_max", "generator.acceleration_max"],
        "arm.position_min": "planner.position_min",
        "arm.position_max": "planner.position_max",
    },
    output_values={
        "position": "near.sensed",
        "error": "near.error",
        "duration": "planner.duration",
        "refused": "planner.refused",
    },
    command_lists={"start": [execute("planner"), activate("generator", every="20 ms"), activate("near", every="20 ms")]},
    conditions={
        "arrived": on("near.done", returns=["position", "error", "duration"]),
        "limit": on("planner.limit", returns=["refused"], raises=PathRefused),
        "time_limit": on(raises=MotionTimeout),
    },
)
def follow(
    arm: Group[Joint],
    /,
    points: Sequence[Sequence[float]] | np.ndarray,
    blend: float | Sequence[float] = 0.05,
    speed: float | Sequence[float] = 0.5,
    tolerance: float = 0.002,
) -> Moved:
    """Moves the joints of an arm through way-points on straight lines in joint space, cutting the corners by no more than `blend`.

    points: 1 to 64 rows of joint positions, rad (m for a sliding joint); blend: by how much a joint may pass a way-point, rad, one
    number or one for each point, 0 to stop there; speed of the fastest joint: rad/s, one number or one for the way to each point;
    tolerance at the last: rad. A point outside a joint's range raises `PathRefused` before it moves.
    """
    ...
