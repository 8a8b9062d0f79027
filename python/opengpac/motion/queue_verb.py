# SPDX-License-Identifier: Apache-2.0
"""The verb that makes an arm follow a queue of moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .. import library as lib
from ..application.reports import Report
from ..cell.signals import DigitalOutput
from ..definition.commands import Command, activate
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..robots.generators import HOMED, PERIOD, gaps, handed, suspended
from ..robots.joints import Joint
from ..system.svvs import SVV
from .arc import _NO_ARC
from .line import LineRefused
from .queue_rows import WaitingMoves, waiting_moves
from .resting import ENDS, HOLDING, RESTED, RESTING, TRANSITIONS

REASONS = (
    "as requested",
    "it would have taken more than half of the move",
    "it would have taken more than half of the next move",
    "the next move came when the arm was near the corner",
    "a stop at the corner is faster",
    "the next move does not blend, or does not exist",
    "a joint would have left its range",
    "a later move replaced it",
)
"""Reasons for the size of a blend, by their numbers in the block."""

ENDS_MAX = 32
"""Number of moves whose ends are kept."""

_REFUSED = ("", "unreachable", "limit", "singular", "no_arc", "duration")
"""Reasons for a refusal, by their numbers in the block."""


class MoveEnd(NamedTuple):
    """End of a move of a queue: its number, the fraction of the requested blend that was achieved, and the reason."""

    number: int
    kept: float
    reason: str


class MoveRefused(LineRefused):
    """A move of a queue that the arm cannot make. No part of it was executed; the arm is at rest at the end of the previous moves.

    `move` is its number in the queue, from 1, and `reason` is `unreachable`, `limit`, `singular`, `no_arc` or `duration`; `joint`
    names the joint whose range the path would leave.
    """

    move: int = 0
    reason: str = ""

    def explanation(self) -> str:
        """Returns the reason, naming the move and the joint."""
        progress = self.outputs["progress"]
        self.move, self.reason = int(progress["refused"]), _REFUSED[int(progress["reason"])]
        self.value = progress["value"]
        return f"move {self.move} of the queue: {self._cause()}"

    def _cause(self) -> str:
        if self.reason == "no_arc":
            return _NO_ARC[int(self.value)]
        if self.reason == "duration":
            return (
                f"within its limits, it takes at least {self.value:.4g} s; give it a longer duration, or increase its speed or acceleration"
            )
        if self.reason == "limit":
            return self._limit()
        if self.reason == "unreachable":
            return f"a point on its path is {self.value:.4g} m out of reach"
        return f"near a singularity on its path, only {self.value:.2%} of the speed is possible; reorient the tool, or choose another path"


class QueueReport(Report):
    """End report of a queue of moves: positions of the joints, maximum distance from a goal, and the ends of the last 32 moves."""

    position: np.ndarray
    error: float

    @property
    def moves(self) -> list[MoveEnd]:
        """Ends of the last 32 moves, in order."""
        return ends_of(self.outputs["progress"])


def no_progress() -> Any:
    """Returns the progress of a queue that has not started."""
    end = {"number": 0, "kept": 0.0, "reason": 0}
    counts = dict.fromkeys(("number", "taken", "refused", "reason", "switched", "on", "resting", "until"), 0)
    return {**counts, "fraction": 0.0, "value": 0.0, "lost": 0.0, "ends": [end] * ENDS_MAX}


def ends_of(progress: Mapping[str, Any] | Any) -> list[MoveEnd]:
    """Returns the ends of the moves that the block's progress contains."""
    found = [MoveEnd(int(end["number"]), float(end["kept"]), REASONS[int(end["reason"])]) for end in progress["ends"] if end["number"] > 0]
    return sorted(found)


_PROGRESS = ["generator.progress"]
_LISTS: dict[str, list[Command]] = {
    "start": [activate("generator", every=PERIOD), activate("near", every=PERIOD)],
    "stop": RESTING,
    "give_up": RESTING,
}
_SWITCHING = [activate("outputs", every=PERIOD)]
_BLOCKS: dict[str, Any] = {"generator": lib.block("queue_generator"), **ENDS}
_BOUND: dict[str, str | list[str]] = {
    "arm.commanded": ["generator.start", "generator.setpoint"],
    **handed(["generator"], ["generator"]),
    "arm.goal": ["generator.target", "near.goal"],
    "arm.sensed": "near.sensed",
    "arm.override": "generator.override",
    "arm.cell_override": "generator.cell_override",
}
_QUEUE: dict[str, Any] = {
    "cells": {"complete": ["generator.complete", "near.complete"], **HOLDING},
    "input_parameters": {
        "moves": input("generator.moves", tunable=True, form=waiting_moves),
        "rate": input("generator.rate", within=(-1.0, 1.0), tunable=True),
        "tolerance": "near.tolerance",
        "chain": input("generator.chain", member="arm.chain"),
        "arm.max_speed": "generator.speed_max",
        "arm.max_acceleration": "generator.acceleration_max",
        "arm.max_jerk": "generator.jerk_max",
        "arm.position_min": "generator.position_min",
        "arm.position_max": "generator.position_max",
        **gaps("generator.gap_max"),
    },
    "output_values": {"position": "near.sensed", "error": "near.error", "progress": "generator.progress"},
    "initial": "start",
    "conditions": {
        "arrived": on("near.done", returns=["position", "error", "progress"], during="start"),
        "refused": on("generator.refused", returns=["position", "progress"], raises=MoveRefused, during="start"),
        **RESTED,
        "stopped": on("generator.held", returns=["position", "progress"], during="stop"),
    },
    "transitions": TRANSITIONS,
    "requires": {"arm.homed": HOMED},
    "suspend": suspended("generator"),
}
"""Common part of both verbs."""


@verb(
    name="move_queue",
    blocks=_BLOCKS,
    objects={"arm": each(Joint)},
    instantiation_parameters={**_BOUND, "progress": _PROGRESS},
    command_lists=_LISTS,
    **_QUEUE,
)
def move_queue(
    arm: Group[Joint],
    progress: SVV[np.ndarray],
    /,
    moves: WaitingMoves,
    rate: float = 1.0,
    tolerance: float = 0.002,
) -> QueueReport:
    """Moves an arm along the path of a queue of moves, which `arm.queue()` fills while it runs.

    progress: an SVV of the type `queue_progress`; moves: the waiting moves, with move k in row k modulo 16, and the number of the
    move at whose end a single step comes to rest; can be set while it runs; rate: fraction of the programmed speed, below 0 back
    along the path; can be set while it runs; tolerance of each joint at the end: rad. A moving arm is braked first. The verb ends
    when the last move is completed; a row of kind 3 declares that no further moves follow. A move that the arm cannot make raises
    `MoveRefused` after the previous moves have been completed.
    """
    ...


@verb(
    name="move_queue_switching",
    blocks={**_BLOCKS, "outputs": lib.block("queue_outputs")},
    objects={"arm": each(Joint), "outputs": each(DigitalOutput)},
    instantiation_parameters={
        **_BOUND,
        "outputs.commanded": ["outputs.start", "outputs.y"],
        "progress": [*_PROGRESS, "outputs.progress"],
    },
    command_lists={name: [*commands, *_SWITCHING] for name, commands in _LISTS.items()},
    **_QUEUE,
)
def move_queue_switching(
    arm: Group[Joint],
    outputs: Group[DigitalOutput],
    progress: SVV[np.ndarray],
    /,
    moves: WaitingMoves,
    rate: float = 1.0,
    tolerance: float = 0.002,
) -> QueueReport:
    """Moves an arm along the path of a queue of moves, like `move_queue`, and switches digital outputs at points on the path.

    outputs: the outputs to which the marks in the rows refer by index, from 1. The other parameters are as in `move_queue`.
    """
    ...
