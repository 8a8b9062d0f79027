# SPDX-License-Identifier: Apache-2.0
"""Start and end of lines and paths. They start from rest, so a moving arm is braked first. When ended early, they come to rest on the
path within their limits.

The planner is executed at the start and stays active: if joints move, it waits until the generator has braked them, and then plans.
`hold` sets the generator's input `holding` when the list that follows `halted` or `time_limit` executes it; the generator then
reports `held`.
"""

from __future__ import annotations

from typing import Any

from .. import library as lib
from ..definition.commands import Command, activate, execute
from ..definition.conditions import on
from ..errors import TimeLost
from ..robots.generators import PERIOD, gaps, handed, slowing
from ..robots.motion import MotionTimeout

ENDS: dict[str, Any] = {"near": lib.block("in_position"), "hold": lib.block("flag")}
"""Blocks for the end of a motion: one reports the arrival of the joints, the other makes the generator come to rest on the path."""

FOLLOWED: dict[str, str | list[str]] = {
    "arm.commanded": ["planner.start", "generator.start", "generator.setpoint"],
    **handed(["planner", "generator"], ["generator"]),
    "arm.goal": ["planner.target", "near.goal"],
    "arm.sensed": "near.sensed",
    "arm.override": "generator.override",
    "arm.cell_override": "generator.cell_override",
}
"""χ of a motion that is planned completely before it is followed: the start, the goal, and the time scale."""

BOUNDS: dict[str, Any] = {
    "arm.max_acceleration": ["planner.acceleration_max", "generator.acceleration_max"],
    "arm.max_jerk": "generator.jerk_max",
    **gaps("generator.gap_max"),
    "arm.position_min": "planner.position_min",
    "arm.position_max": "planner.position_max",
}
"""ψ of the motion's planner and generator."""

HOLDING: dict[str, list[str]] = {"holding": ["hold.y", "generator.holding"]}
"""Cell that makes the generator come to rest on the path."""

RESTING: list[Command] = [execute("hold"), activate("generator", every=PERIOD)]
"""Command list in which a motion comes to rest on its path."""

LISTS: dict[str, list[Command]] = {
    "start": [
        execute("planner"),
        activate("planner", every=PERIOD),
        activate("generator", every=PERIOD),
        activate("near", every=PERIOD),
    ],
    "stop": RESTING,
    "give_up": RESTING,
}
"""Command lists: one for the motion, and two for its premature ends."""

RESTED: dict[str, Any] = {
    "stopped": on("generator.held", returns=["position"], during="stop"),
    "timed_out": on("generator.held", returns=["position"], raises=MotionTimeout, during="give_up"),
    "time_lost": on("generator.gap", returns=["position"], raises=TimeLost, during="start"),
}
"""Conditions of the two premature ends, and of the end after time was lost."""

TRANSITIONS = {("start", "halted"): "stop", ("start", "time_limit"): "give_up", **slowing("stop", "give_up")}
"""Transitions to the two premature ends."""
