# SPDX-License-Identifier: Apache-2.0
"""Common parts of motion verbs: the binding of generators to the joints of an object, and the command lists in which the joints slow
down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from .. import library as lib
from ..definition.commands import Command, activate
from ..definition.conditions import on
from ..definition.parameters import input, required
from ..definition.suspension import Holding, holding
from ..errors import NotHomed, TimeLost

Values: TypeAlias = float | str | Sequence[float | str] | np.ndarray
"""One value for all joints, or one for each: numbers in SI units, or text, `"90 deg"`, `"30 %"` of a limit."""

PERIOD = "20 ms"
"""Interval at which set-points are stored."""

LEAST = 1e-6
"""Minimum speed or acceleration that can be requested."""

HOMED = required(NotHomed, when="arm.needs_home", remedy="home it first: gpac.motion.home(…) or home_here(…)")
"""Requirement of a motion to a position: the joint must be homed."""


def handed(takes: Sequence[str], gives: Sequence[str], velocity: Mapping[str, str] | None = None) -> dict[str, list[str]]:
    """Returns χ of the handover between motions. `takes` contains the labels of the blocks that start from the handed-over state,
    `gives` those of the blocks that provide it.

    `velocity` gives the name of a label's speed output if it is not `setpoint_velocity`.
    """
    names = velocity or {}
    return {
        "arm.commanded_velocity": [f"{label}.start_velocity" for label in takes],
        "arm.setpoint_velocity": [
            *(f"{label}.last_velocity" for label in takes),
            *(f"{label}.{names.get(label, 'setpoint_velocity')}" for label in gives),
        ],
        "arm.setpoint_acceleration": [
            *(f"{label}.last_acceleration" for label in takes),
            *(f"{label}.setpoint_acceleration" for label in gives),
        ],
        "arm.setpoint_time": [*(f"{label}.last_time" for label in takes), *(f"{label}.setpoint_time" for label in gives)],
        "arm.braking": [f"{label}.braking" for label in takes],
    }


def bound(*generators: str, overridden: Sequence[str] = (), velocity: Mapping[str, str] | None = None) -> dict[str, list[str]]:
    """Returns χ of generators that take over from each other: position, speed and set-points of the joints."""
    commanded = [f"{label}.{port}" for label in generators for port in ("start", "setpoint")]
    found = {"arm.commanded": commanded, **handed(generators, generators, velocity)}
    if overridden:
        found["arm.override"] = [f"{label}.override" for label in overridden]
        found["arm.cell_override"] = [f"{label}.cell_override" for label in overridden]
    return found


def limited(*generators: str) -> dict[str, Any]:
    """Returns ψ of generators: the jerk limit and the range of the joints, and the maximum gap in time."""
    ports = {"arm.max_jerk": "jerk", "arm.position_min": "position_min", "arm.position_max": "position_max"}
    return {
        **{parameter: [f"{label}.{port}" for label in generators] for parameter, port in ports.items()},
        **gaps(*(f"{label}.gap_max" for label in generators)),
    }


def gaps(*ports: str) -> dict[str, Any]:
    """Returns ψ of the maximum gap in time. The parameter is tunable, so that changes take effect immediately."""
    return {"arm.max_gap": input(list(ports), tunable=True)}


def share(targets: str | list[str], most: str) -> Any:
    """Returns an input parameter whose range is from almost zero to a limit of each joint."""
    return input(targets, within=(LEAST, f"arm.{most}"))


def brake() -> Any:
    """Returns the block that slows the joints down when a motion is halted: a velocity generator with goal zero."""
    return lib.block("velocity_generator")


def suspended(*generators: str) -> Holding:
    """Returns the suspension of a motion. The motion slows down on its path, and resumes from there; a motion that is already slowing
    down to its end completes first."""
    return holding([f"{label}.holding" for label in generators], [f"{label}.held" for label in generators])


def slowing(*lists: str) -> dict[tuple[str, str], str]:
    """Returns τ of the lists in which joints already slow down; the joints come to rest after a first halt or a time limit."""
    return {key: to for name in lists for key, to in (((name, "halted"), "stop"), ((name, "time_limit"), name))}


STOP: list[Command] = [activate("brake", every=PERIOD)]
"""Command list that follows `halted`; the verb ends when the joints are at rest."""

GAP: dict[str, Any] = {"time_lost": on("generator.gap", returns=["position"], raises=TimeLost, during="start")}
"""Termination of a motion that has come to rest because too much time was lost."""
