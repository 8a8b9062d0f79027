# SPDX-License-Identifier: Apache-2.0
"""Moves the tool of an arm along a circular arc."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from .. import library as lib
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..errors import CallError, refuse
from ..robots.generators import HOMED, suspended
from ..robots.joints import Joint
from ..robots.motion import Moved
from ..values.frames import Pose
from .line import LineRefused
from .resting import BOUNDS, ENDS, FOLLOWED, HOLDING, LISTS, RESTED, TRANSITIONS

ORIENTATIONS = ("via", "goal", "path")
"""Orientations of the tool along an arc, in the order of the planner's numbers for them."""

_NO_ARC = {
    1: "'via' is the current pose of the tool; choose a pose between it and the goal",
    2: "'via' is the goal; choose a pose between it and the tool",
    3: "the goal is the current pose of the tool; for a full circle, pass another pose on the circle as the goal, and angle='360 deg'",
    4: "tool, 'via' and goal are on a straight line, but 'via' is not between the other two; move 'via' off the line, or use move_linear",
    5: "tool, 'via' and goal are on a straight line, which has no angle; choose a 'via' off the line, or omit 'angle'",
    6: "the angle ends before 'via', whose orientation is requested; choose a larger angle, or orientation='goal' or 'path'",
}
"""Error in the three poses, and the remedy, by the value of `no_arc`."""


class ArcRefused(LineRefused):
    """An arc that the arm cannot follow. `condition` is `no_arc`, `unreachable`, `limit` or `singular`; the arm has not moved.

    `no_arc`: the poses do not define a circle, and the message contains the remedy; `joint` names the joint whose range the path
    would leave.
    """

    def _why(self) -> str:
        if self.condition == "no_arc":
            return _NO_ARC[int(self.value)]
        if self.condition == "unreachable":
            return f"a point of the arc is {self.value:.4g} m out of reach; move 'via' or the goal closer to the arm"
        return super()._why().replace("of the line", "of the arc").replace("on the line", "on the arc")


def _orientation(given: Any, objects: Mapping[str, Any]) -> int:
    """Returns the planner's number for an orientation."""
    if isinstance(given, str) and given in ORIENTATIONS:
        return ORIENTATIONS.index(given)
    if isinstance(given, int) and not isinstance(given, bool) and 0 <= given < len(ORIENTATIONS):
        return given
    refuse(CallError, f"'orientation' must be 'via', 'goal' or 'path', not {given!r:.80}", "pass orientation='path', for example")


@verb(
    name="move_circular",
    blocks={
        "planner": lib.block("arc_planner")(waits=True),
        "generator": lib.block("line_generator"),
        **ENDS,
    },
    objects={"arm": each(Joint)},
    instantiation_parameters=FOLLOWED,
    cells={"line": ["planner.line", "generator.line"], "complete": ["generator.complete", "near.complete"], **HOLDING},
    input_parameters={
        "via": "planner.via",
        "goal": "planner.goal",
        "speed": "planner.speed",
        "angular_speed": "planner.angular_speed",
        "acceleration": "planner.acceleration",
        "angle": "planner.angle",
        "orientation": input("planner.orientation", form=_orientation),
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
        "no_arc": on("planner.no_arc", raises=ArcRefused),
        "unreachable": on("planner.unreachable", raises=ArcRefused),
        "limit": on("planner.limit", raises=ArcRefused),
        "singular": on(["planner.singular", "generator.singular"], raises=ArcRefused),
        **RESTED,
    },
)
def move_circular(
    arm: Group[Joint],
    /,
    via: Pose | Sequence[float] | np.ndarray,
    goal: Pose | Sequence[float] | np.ndarray,
    speed: float = 0.25,
    angular_speed: float = 1.0,
    acceleration: float = 1.0,
    angle: float = 0.0,
    orientation: Literal["via", "goal", "path"] = "via",
    tolerance: float = 0.002,
) -> Moved:
    """Moves the tool of an arm from rest along an arc of the circle through its pose, an intermediate pose and a goal.

    via, goal: `gpac.Pose`, or x y z (m) and quaternion w x y z; speed: m/s; angular_speed: rad/s; acceleration of the tool, including
    the centripetal acceleration: m/s²; angle: of the whole arc, up to two full circles (`"360 deg"` is one), 0: to the goal;
    tolerance of each joint at the end: rad. `orientation="via"` passes through the orientations of start, via and goal, `"goal"`
    turns uniformly from the start orientation to the goal orientation, and `"path"` keeps the orientation constant relative to the
    path, regardless of the orientations of via and goal. The tool moves more slowly if the joints require it. Three collinear poses
    give a straight line if via is between the others. A moving arm is braked first. An arc that the arm cannot follow raises
    `ArcRefused` before the arm moves.
    """
    ...
