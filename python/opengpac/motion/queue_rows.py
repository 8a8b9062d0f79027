# SPDX-License-Identifier: Apache-2.0
"""Rows of the waiting moves of a queue, created from the arguments of a program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import _native
from ..cell.signals import DigitalOutput
from ..devices.groups import Group
from ..errors import CallError, OutOfRange, UnknownName, refusals, refuse
from ..robots.joints import Joint
from ..robots.kinematics import JOINTS_MAX
from ..values.frames import Pose
from ..values.numbers import number
from ..values.quantities import Quantity, duration_ns
from .arc import ORIENTATIONS

MODES = {"buffered": 0, "blending": 1, "aborting": 2}
"""Buffer modes of PLCopen, with their numbers in the block."""

JOINTS, LINE, ARC, CLOSE = range(4)
"""Kinds of rows."""

WAITING_MAX = 16
"""Number of rows, which is the maximum number of waiting moves."""

JERKS = (10.0, 50.0)
"""Maximum jerk of the tool's position and of its orientation, per unit of linear acceleration, 1/s."""

MARKS_MAX = 4
"""Maximum number of outputs that a move may switch."""

_ANGLES = ("deg", "rad", "°")
"""Suffixes of texts that specify angles."""

_NO_MARK = {"output": 0, "on": 0, "before": 0.0, "unit": 0, "ahead": 0.0}
_POSE = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]


@dataclass(frozen=True)
class At:
    """A point on the path at which an output is switched. Created by `gpac.motion.at`."""

    output: DigitalOutput
    on: bool
    before: float | str
    ahead: float


def at(output: DigitalOutput, on: bool = True, *, before: float | str = 0.0, ahead: Quantity = 0.0) -> At:
    """Returns a mark, which switches an output during a move of a queue: `moves.linear(pose, marks=[at(glue, before="5 mm")])`.

    output: one of those passed to `arm.queue(outputs=[…])`; before: distance before the goal of the move along its path, in the units
    of `blend`; ahead: time by which the output is switched earlier, to allow for the delay of the device, s. The output is switched
    when the set-point reaches this point, at any speed, and is switched back if the arm moves back along the path.
    """
    if not isinstance(output, DigitalOutput):
        refuse(CallError, f"'output' must be a digital output, not {output!r:.80}", "pass one: gpac.cell.DigitalOutput(…)")
    return At(output, bool(on), before, duration_ns(ahead, "'ahead'") * 1e-9)


def marks_of(marks: Sequence[At], outputs: Sequence[DigitalOutput], kind: int) -> list[dict[str, Any]]:
    """Returns the rows of the outputs that a move switches, in the order of their points on the path."""
    if len(marks) > MARKS_MAX:
        refuse(CallError, f"a move must have at most {MARKS_MAX} marks, not {len(marks)}", "add another move")
    found = []
    for mark in marks:
        if mark.output not in outputs:
            remedy = f"name it when you create the queue: arm.queue(outputs=[{mark.output.name}])"
            refuse(CallError, f"'{mark.output.name}' is not an output of this queue", remedy)
        placed = blend_of(mark.before, kind)
        row = {"output": outputs.index(mark.output) + 1, "on": int(mark.on), "ahead": mark.ahead}
        found.append({**row, "before": placed["blend"], "unit": placed["blend_unit"]})
    if len({row["unit"] for row in found}) > 1:
        refuse(
            CallError,
            "the marks of a move mix distances and percentages of the path",
            "give all of them as distances, or all as percentages",
        )
    found.sort(key=lambda row: -row["before"])
    return [*found, *[_NO_MARK] * (MARKS_MAX - len(found))]


class WaitingMoves(NamedTuple):
    """Waiting moves of a queue, with move k in row k modulo 16, and the number of the move at whose end a single step comes to rest."""

    rows: Sequence[Mapping[str, Any]]
    until: int | None = None


def waiting_moves(given: WaitingMoves, objects: Mapping[str, Any]) -> dict[str, Any]:
    """Converts the waiting moves to the value of the block's input."""
    rows, until = given
    return {"stepping": int(until is not None), "until": until or 0, "rows": list(rows)}


def empty_row() -> dict[str, Any]:
    """Returns a row without a move."""
    nothing = [0.0] * JOINTS_MAX
    return {
        "number": 0, "kind": JOINTS, "mode": 0, "orientation": 0, "blend_unit": 0, "blend": 0.0, "angle": 0.0, "duration": 0.0,
        "joints": nothing, "pose": _POSE, "via": _POSE, "speed": nothing, "acceleration": nothing,
        "linear": [0.0] * 3, "angular": [0.0] * 3, "marks": [_NO_MARK] * MARKS_MAX,
    }  # fmt: skip


def mode_of(mode: str) -> int:
    """Returns the number of a buffer mode."""
    if mode not in MODES:
        refuse(CallError, f"'mode' must be 'blending', 'buffered' or 'aborting', not {mode!r:.80}", "pass mode='buffered', for example")
    return MODES[mode]


def value_of(given: Any, unit: str, what: str, least: float = 0.0) -> float:
    """Returns a number above `least`; also accepts text with a unit."""
    if isinstance(given, str):
        with refusals:
            found = _native.number_in(given, unit)
    else:
        found = number(given)
    if isinstance(found, bool) or not isinstance(found, int | float) or not np.isfinite(found):
        refuse(CallError, f"'{what}' must be a finite number, not {given!r:.80}", f"pass a number in {unit}, or a string with a unit")
    if not found > least:
        refuse(OutOfRange, f"'{what}' must be above {least:g} {unit}, not {given}", "give a larger value")
    return float(found)


def blend_of(given: Any, kind: int) -> dict[str, Any]:
    """Returns the radius of a blend and its unit: a fraction of the path, rad of the joint that moves furthest, m of the tool, or rad of
    its orientation."""
    unit = "rad" if kind == JOINTS else "m"
    if isinstance(given, str) and given.strip().endswith("%"):
        share = value_of(given.strip()[:-1].strip() or given, "", "blend", -1e-300) / 100
        if share > 1:
            refuse(OutOfRange, f"'blend' is {given}, but its range is 0 to 100 %", "give a percentage of the path in this range")
        return {"blend": share, "blend_unit": 0}
    if kind != JOINTS and isinstance(given, str) and given.strip().endswith(_ANGLES):
        return {"blend": value_of(given, "rad", "blend", -1e-300), "blend_unit": 3}
    return {"blend": value_of(given, unit, "blend", -1e-300), "blend_unit": 1 if kind == JOINTS else 2}


def duration_of(given: Quantity | None) -> float:
    """Returns the duration of a move, s; 0 if none is set."""
    if given is None:
        return 0.0
    span_s = duration_ns(given, "'duration'") * 1e-9
    if not span_s > 0:
        refuse(OutOfRange, f"'duration' must be above 0 s, not {given}", "give a time, such as '2 s'")
    return span_s


def goals_of(arm: Group[Joint], goal: Any, before: Sequence[float] | None) -> list[float]:
    """Returns the goal of each joint, which must be within its range; `before` contains the previous goals, for joints that a dictionary
    omits."""
    if isinstance(goal, Mapping):
        if before is None:
            remedy = "give a position for every joint: after a move of the tool, the program does not know where the other joints are"
            refuse(CallError, "a goal that gives only some of the joints cannot follow a move of the tool", remedy)
        wanted: list[Any] = list(before)
        for name, value in goal.items():
            if name not in arm.short_names and name not in [joint.name for joint in arm]:
                refuse(
                    UnknownName,
                    f"'goal' names '{name}', which is not a joint of '{arm.name}'",
                    f"use names of its joints: {', '.join(arm.short_names)}",
                )
            wanted[[joint.name for joint in arm].index(arm[name].name)] = value
        goal = wanted
    return [_within(joint, value) for joint, value in zip(arm, _each(arm, goal, "goal"), strict=True)]


def _within(joint: Joint, given: Any) -> float:
    unit = joint.sensed.unit or "rad"
    value = value_of(given, unit, "goal", -np.inf)
    low, high = joint.position_min, joint.position_max
    if not low <= value <= high:
        in_degrees = unit == "rad" and not isinstance(given, str) and low <= np.deg2rad(value) <= high
        refuse(
            OutOfRange,
            f"'goal' for '{joint.name}' is {value:.6g} {unit}, but its range is {low:.6g} to {high:.6g} {unit} "
            "(position_min to position_max)",
            f"did you mean '{given} deg'?" if in_degrees else "give a position within this range",
        )
    return value


def shares_of(arm: Group[Joint], given: Any, limit: str, unit: str, what: str) -> list[float]:
    """Returns a positive value for each joint, no larger than its limit: `"30 %"` is that fraction of the limit, and a single value
    applies to all joints."""
    return [_share(joint, value, limit, unit, what) for joint, value in zip(arm, _each(arm, given, what), strict=True)]


def _share(joint: Joint, given: Any, limit: str, unit: str, what: str) -> float:
    most = getattr(joint, limit)
    if isinstance(given, str) and given.strip().endswith("%"):
        value = most * value_of(given.strip()[:-1].strip(), "", what) / 100
    else:
        value = value_of(given, unit if joint.sensed.unit != "m" else unit.replace("rad", "m"), what)
    if value > most * (1 + 1e-9):
        refuse(OutOfRange, f"'{what}' for '{joint.name}' is {given}, but its range is 0 to {most:.6g} ({limit})", "give a smaller value")
    return value


def _each(arm: Group[Joint], given: Any, what: str) -> list[Any]:
    if isinstance(given, str) or isinstance(number(given), int | float):
        return [given] * len(arm)
    values = list(given)
    if len(values) != len(arm):
        refuse(
            CallError,
            f"'{what}' has {len(values)} values, but '{arm.name}' has {len(arm)} joints",
            "give one value for all joints, or one for each",
        )
    return values


def tool_row(speed: Any, angular_speed: Any, acceleration: Any) -> dict[str, Any]:
    """Returns the limits of a move of the tool."""
    linear, angular = value_of(speed, "m/s", "speed"), value_of(angular_speed, "rad/s", "angular_speed")
    quick = value_of(acceleration, "m/s^2", "acceleration")
    return {"linear": [linear, quick, JERKS[0] * quick], "angular": [angular, 5.0 * quick, JERKS[1] * quick]}


def orientation_of(given: Any) -> int:
    """Returns the number of an orientation along an arc."""
    if given not in ORIENTATIONS:
        refuse(CallError, f"'orientation' must be 'via', 'goal' or 'path', not {given!r:.80}", "pass orientation='path', for example")
    return ORIENTATIONS.index(given)


def pose_of(given: Any, frame: Any = None) -> list[float]:
    """Returns a pose as seven numbers. If `frame` is not None, the pose is relative to it."""
    pose = Pose.of(given)
    return [float(x) for x in (pose if frame is None else Pose.of(frame) @ pose)]


def padded(values: Sequence[float]) -> list[float]:
    """Pads the values with zeros to the maximum number of joints of a block."""
    return [*values, *[0.0] * (JOINTS_MAX - len(values))]
