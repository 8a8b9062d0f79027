# SPDX-License-Identifier: Apache-2.0
"""Moves the joints of an arm through way-points without stopping at them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import library as lib
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..errors import Terminated, Unreachable
from ..robots.generators import HOMED, handed, suspended
from ..robots.joints import Joint
from ..robots.motion import Moved
from .resting import BOUNDS, ENDS, FOLLOWED, HOLDING, LISTS, RESTED, TRANSITIONS
from .tables import POINTS_MAX, Form, each_long_point, each_point, long_way_points, way_points


class PathRefused(Terminated, Unreachable):
    """A way-point is outside the range of a joint; the arm has not moved. `joint` and `point` (from 0) identify them."""

    joint: str | None = None
    point: int | None = None

    def explanation(self) -> str:
        """Returns the index of the way-point and the name of the joint."""
        if "arm" not in self.objects:
            return f"a waypoint is outside the range of joint {self.value} (counted from 0)"
        arm = self.objects["arm"]
        joint, self.joint, self.point = arm[int(self.value)], arm.short_names[int(self.value)], int(self.outputs["refused"])
        low, high = joint.position_min, joint.position_max
        range_text = f"{low:.6g} to {high:.6g}"
        return (
            f"waypoint {self.point} is outside the range of joint '{self.joint}', {range_text}; if the points are "
            "in degrees, convert them: gpac.deg(points)"
        )


def _inputs(points: Form, each: Form) -> dict[str, Any]:
    """Returns ψ, with the functions that convert lists to tables."""
    return {
        "points": input("planner.points", form=points),
        "blend": input("planner.blend", form=each),
        "speed": input("planner.speed", form=each),
        "tolerance": "near.tolerance",
        "arm.max_speed": "planner.speed_max",
        **BOUNDS,
    }


_FOLLOW: dict[str, Any] = {
    "objects": {"arm": each(Joint)},
    "instantiation_parameters": {
        **FOLLOWED,
        **handed(["planner", "generator"], ["generator"], velocity={"generator": "velocity"}),
    },
    "cells": {"path": ["planner.path", "generator.path"], "complete": ["generator.complete", "near.complete"], **HOLDING},
    "output_values": {
        "position": "near.sensed",
        "error": "near.error",
        "duration": "planner.duration",
        "refused": "planner.refused",
    },
    "command_lists": LISTS,
    "initial": "start",
    "transitions": TRANSITIONS,
    "requires": {"arm.homed": HOMED},
    "suspend": suspended("generator"),
    "conditions": {
        "arrived": on("near.done", returns=["position", "error", "duration"], during="start"),
        "limit": on("planner.limit", returns=["refused"], raises=PathRefused),
        **RESTED,
    },
}
"""Common part of both verbs."""


@verb(
    name="follow",
    blocks={"planner": lib.block("path_planner")(waits=True), "generator": lib.block("path_generator"), **ENDS},
    input_parameters=_inputs(way_points, each_point),
    **_FOLLOW,
)
def follow(
    arm: Group[Joint],
    /,
    points: Sequence[Sequence[float]] | np.ndarray,
    blend: float | Sequence[float] = 0.05,
    speed: float | Sequence[float] = 0.5,
    tolerance: float = 0.002,
) -> Moved:
    """Moves the joints of an arm through way-points on straight lines in joint space, cutting corners by no more than `blend`.

    points: 1 to 4,096 rows of joint positions, rad (m for a prismatic joint); blend: maximum distance of a joint from a way-point,
    rad, one number or one for each point, 0 to stop there; speed of the fastest joint: rad/s, one number or one for the path to each
    point; tolerance at the last point: rad. A point outside a joint's range raises `PathRefused` before the arm moves. More than 64
    points require `follow_long`. A call uses it automatically; `new_instance` and compositions cannot, because they do not know the
    number of points in advance.
    """
    ...


@verb(
    name="follow_long",
    blocks={"planner": lib.block("long_path_planner")(waits=True), "generator": lib.block("long_path_generator"), **ENDS},
    input_parameters=_inputs(long_way_points, each_long_point),
    **_FOLLOW,
)
def follow_long(
    arm: Group[Joint],
    /,
    points: Sequence[Sequence[float]] | np.ndarray,
    blend: float | Sequence[float] = 0.05,
    speed: float | Sequence[float] = 0.5,
    tolerance: float = 0.002,
) -> Moved:
    """Moves the joints of an arm through up to 4,096 way-points, like `follow`, with tables of that size, which occupy 1.3 MB while it
    exists.

    Intended for `new_instance` and compositions; a call to `follow` with more than 64 points uses it. The path is planned over
    several cycles: an arm at rest begins to move up to 0.2 s later.
    """
    ...


follow._takes_longer("points", POINTS_MAX, follow_long)
