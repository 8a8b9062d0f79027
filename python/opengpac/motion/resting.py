# SPDX-License-Identifier: Apache-2.0
"""How lines and paths end before their end: they come to rest on their way, within their limits, and report `held`.

`hold` sets the generator's input `holding` when the list that follows `halted` or `time_limit` executes it.
"""

from __future__ import annotations

from typing import Any

from .. import library as lib
from ..commands import Command, activate, execute
from ..conditions import on
from ..robots.motion import MotionTimeout
from .parts import PERIOD, slowing

ENDS: dict[str, Any] = {"near": lib.block("in_position"), "hold": lib.block("flag")}
"""What tells that the joints are there, and the block that makes the generator come to rest on its way."""

FOLLOWED: dict[str, str | list[str]] = {
    "arm.commanded": ["planner.start", "generator.setpoint"],
    "arm.goal": ["planner.target", "near.goal"],
    "arm.sensed": "near.sensed",
    "arm.override": "generator.override",
    "arm.cell_override": "generator.cell_override",
}
"""χ of a motion that is planned whole and then followed: where it begins, where it leads, and how fast its time passes."""

HOLDING: dict[str, list[str]] = {"holding": ["hold.y", "generator.holding"]}
"""Its cell."""

_REST: list[Command] = [execute("hold"), activate("generator", every=PERIOD)]

LISTS: dict[str, list[Command]] = {
    "start": [execute("planner"), activate("generator", every=PERIOD), activate("near", every=PERIOD)],
    "stop": _REST,
    "give_up": _REST,
}
"""The command lists: the motion, and two ways to its end before it is there."""

RESTED: dict[str, Any] = {
    "stopped": on("generator.held", returns=["position"], during="stop"),
    "timed_out": on("generator.held", returns=["position"], raises=MotionTimeout, during="give_up"),
}
"""The conditions of those two ends."""

TRANSITIONS = {("start", "halted"): "stop", ("start", "time_limit"): "give_up", **slowing("stop", "give_up")}
"""What leads there."""
