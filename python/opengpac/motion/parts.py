# SPDX-License-Identifier: Apache-2.0
"""What the verbs of motion share: how a generator is bound to the joints of an object, and the list in which they slow down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from .. import library as lib
from ..commands import Command, activate
from ..errors import NotHomed
from ..parameters import input, required
from ..suspension import Holding, holding

Values: TypeAlias = float | str | Sequence[float | str] | np.ndarray
"""One value for all joints, or one for each: numbers in SI units, or text, `"90 deg"`, `"30 %"` of a limit."""

PERIOD = "20 ms"
"""How often set-points are stored."""

LEAST = 1e-6
"""The minimum speed or acceleration that can be asked for."""

HOMED = required(NotHomed, when="arm.needs_home", remedy="find its zero first: gpac.motion.home(…) or home_here(…)")
"""A motion to a position needs a joint that knows where it is."""


def bound(*generators: str, overridden: Sequence[str] = ()) -> dict[str, list[str]]:
    """χ of generators that take over from each other: where the joints are, how fast they are, where they are to be."""
    commanded = [f"{label}.{port}" for label in generators for port in ("start", "setpoint")]
    found = {"arm.commanded": commanded, "arm.commanded_velocity": [f"{label}.start_velocity" for label in generators]}
    if overridden:
        found["arm.override"] = [f"{label}.override" for label in overridden]
        found["arm.cell_override"] = [f"{label}.cell_override" for label in overridden]
    return found


def limited(*generators: str) -> dict[str, list[str]]:
    """ψ of generators: the jerk and the range of the joints."""
    ports = {"arm.max_jerk": "jerk", "arm.position_min": "position_min", "arm.position_max": "position_max"}
    return {parameter: [f"{label}.{port}" for label in generators] for parameter, port in ports.items()}


def share(targets: str | list[str], most: str) -> Any:
    """An input parameter between nearly nothing and a limit of each joint."""
    return input(targets, within=(LEAST, f"arm.{most}"))


def brake() -> Any:
    """What slows the joints down when a motion is halted: a velocity generator that is to stand still."""
    return lib.block("velocity_generator")


def suspended(*generators: str) -> Holding:
    """How a motion is suspended: it slows down on its way, and goes on from there; one that slows down to its end comes to it."""
    return holding([f"{label}.holding" for label in generators], [f"{label}.held" for label in generators])


def slowing(*lists: str) -> dict[tuple[str, str], str]:
    """τ of the lists in which joints slow down already: a first halt and a time limit let them come to rest."""
    return {key: to for name in lists for key, to in (((name, "halted"), "stop"), ((name, "time_limit"), name))}


STOP: list[Command] = [activate("brake", every=PERIOD)]
"""The command list that follows `halted`: the verb ends when the joints are at rest."""
