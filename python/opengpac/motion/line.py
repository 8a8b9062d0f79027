# SPDX-License-Identifier: Apache-2.0
"""Moves the tool of an arm along straight lines and arcs."""

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
from ..robots.generators import HOMED, suspended
from ..robots.joints import Joint
from ..robots.motion import Moved
from ..values.frames import Pose
from .resting import BOUNDS, ENDS, FOLLOWED, HOLDING, LISTS, RESTED, TRANSITIONS
from .tables import POINTS_MAX, Form, each_long_point, each_point, long_poses, poses


class LineRefused(Terminated, Unreachable):
    """A straight line that the arm cannot follow. `condition` is `unreachable`, `limit` or `singular`; the arm has not moved.

    `joint` names the joint whose range the path would leave; `point` is the index of the target pose if there are several.
    """

    joint: str | None = None
    point: int | None = None

    def explanation(self) -> str:
        """Returns the reason, the name of the joint, and the index of the pose."""
        if self.outputs.get("refused", -1) < 0:
            return self._why()
        self.point = int(self.outputs["refused"])
        return f"on the way to pose {self.point}: {self._why()}"

    def _why(self) -> str:
        if self.condition == "unreachable":
            return f"the goal is {self.value:.4g} m out of reach"
        if self.condition == "limit":
            return self._limit()
        if self.block == "generator":
            return f"the arm reached a singularity after {self.value:.0%} of the line"
        return f"near a singularity on the line, only {self.value:.2%} of the speed is possible; reorient the tool, or choose another path"

    def _limit(self) -> str:
        if "arm" not in self.objects:
            return f"joint {self.value} (counted from 0) would leave its range; start from another posture"
        arm = self.objects["arm"]
        joint, self.joint = arm[int(self.value)], arm.short_names[int(self.value)]
        low, high = joint.position_min, joint.position_max
        return f"joint '{self.joint}' would leave its range, {low:.6g} to {high:.6g}; start from another posture"


@verb(
    name="move_linear",
    blocks={
        "planner": lib.block("line_planner")(waits=True),
        "generator": lib.block("line_generator"),
        **ENDS,
    },
    objects={"arm": each(Joint)},
    instantiation_parameters=FOLLOWED,
    cells={"line": ["planner.line", "generator.line"], "complete": ["generator.complete", "near.complete"], **HOLDING},
    input_parameters={
        "pose": "planner.goal",
        "speed": "planner.speed",
        "angular_speed": "planner.angular_speed",
        "acceleration": "planner.acceleration",
        "tolerance": "near.tolerance",
        "chain": input(["planner.chain", "generator.chain"], member="arm.chain"),
        "arm.max_speed": ["planner.speed_max", "generator.speed_max"],
        **BOUNDS,
    },
    output_values={"position": "near.sensed", "error": "near.error", "duration": "planner.duration"},
    command_lists=LISTS,
    initial="start",
    transitions=TRANSITIONS,
    requires={"arm.homed": HOMED},
    suspend=suspended("generator"),
    conditions={
        "arrived": on("near.done", returns=["position", "error", "duration"], during="start"),
        "unreachable": on("planner.unreachable", raises=LineRefused),
        "limit": on("planner.limit", raises=LineRefused),
        "singular": on(["planner.singular", "generator.singular"], raises=LineRefused),
        **RESTED,
    },
)
def move_linear(
    arm: Group[Joint],
    /,
    pose: Pose | Sequence[float] | np.ndarray,
    speed: float = 0.25,
    angular_speed: float = 1.0,
    acceleration: float = 1.0,
    tolerance: float = 0.002,
) -> Moved:
    """Moves the tool of an arm from rest along a straight line to a pose, turning it uniformly about one axis.

    pose: `gpac.Pose`, or x y z (m) and quaternion w x y z; speed: m/s; angular_speed: rad/s; acceleration: m/s²; tolerance of each
    joint at the end: rad. The tool moves more slowly if the joints require it. A moving arm is braked first. A line that the arm
    cannot follow raises `LineRefused` before the arm moves.
    """
    ...


def _inputs(points: Form, each: Form) -> dict[str, Any]:
    """Returns ψ of a path of several lines, with the functions that convert lists to tables."""
    return {
        "poses": input("planner.poses", form=points),
        "blend": input("planner.blend", form=each),
        "speed": input("planner.speed", form=each),
        "angular_speed": "planner.angular_speed",
        "acceleration": "planner.acceleration",
        "tolerance": "near.tolerance",
        "chain": input(["planner.chain", "generator.chain"], member="arm.chain"),
        "arm.max_speed": ["planner.speed_max", "generator.speed_max"],
        **BOUNDS,
    }


_FOLLOW: dict[str, Any] = {
    "objects": {"arm": each(Joint)},
    "instantiation_parameters": FOLLOWED,
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
        "unreachable": on("planner.unreachable", returns=["refused"], raises=LineRefused),
        "limit": on("planner.limit", returns=["refused"], raises=LineRefused),
        "singular": on(["planner.singular", "generator.singular"], returns=["refused"], raises=LineRefused),
        **RESTED,
    },
}
"""Common part of the two verbs that follow several straight lines."""


@verb(
    name="follow_linear",
    blocks={"planner": lib.block("polyline_planner")(waits=True), "generator": lib.block("polyline_generator"), **ENDS},
    input_parameters=_inputs(poses, each_point),
    **_FOLLOW,
)
def follow_linear(
    arm: Group[Joint],
    /,
    poses: Sequence[Pose | Sequence[float]],
    blend: float | Sequence[float] = 0.01,
    speed: float | Sequence[float] = 0.25,
    angular_speed: float = 1.0,
    acceleration: float = 1.0,
    tolerance: float = 0.002,
) -> Moved:
    """Moves the tool of an arm through poses on straight lines, from rest to rest, cutting corners by no more than `blend`.

    poses: 1 to 4,096; blend: maximum distance of the tool from a pose, m, one number or one for each, 0 to stop there; speed: m/s,
    one number or one for the path to each pose; angular_speed: rad/s; acceleration: m/s²; tolerance of each joint at the end: rad.
    The tool moves more slowly if the joints require it. A path that the arm cannot follow raises `LineRefused` before the arm moves;
    its `point` is the index of the pose. More than 64 poses require `follow_linear_long`. A call uses it automatically;
    `new_instance` and compositions cannot, because they do not know the number of poses in advance.
    """
    ...


@verb(
    name="follow_linear_long",
    blocks={"planner": lib.block("long_polyline_planner")(waits=True), "generator": lib.block("long_polyline_generator"), **ENDS},
    input_parameters=_inputs(long_poses, each_long_point),
    **_FOLLOW,
)
def follow_linear_long(
    arm: Group[Joint],
    /,
    poses: Sequence[Pose | Sequence[float]],
    blend: float | Sequence[float] = 0.01,
    speed: float | Sequence[float] = 0.25,
    angular_speed: float = 1.0,
    acceleration: float = 1.0,
    tolerance: float = 0.002,
) -> Moved:
    """Moves the tool of an arm through up to 4,096 poses, like `follow_linear`, with tables of that size, which occupy 1.1 MB while it
    exists.

    Intended for `new_instance` and compositions; a call to `follow_linear` with more than 64 poses uses it. The path is planned over
    several cycles, and followed by inverse kinematics: an arm at rest begins to move up to 0.6 s later.
    """
    ...


follow_linear._takes_longer("poses", POINTS_MAX, follow_linear_long)
