# SPDX-License-Identifier: Apache-2.0
"""The paper's own example: coordinated motion of the joints of an arm, all arriving together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import library as lib
from ..commands import activate, execute
from ..conditions import on
from ..decorated import verb
from ..errors import NotHomed, Terminated
from ..groups import Group
from ..parameters import each, input, required
from ..reports import Report
from .joints import Joint


class MotionTimeout(Terminated):
    """A motion did not end within its time limit."""


class Moved(Report):
    """How a motion ended: where the joints are (rad), how far the worst is from its goal (rad), how long it was planned (s)."""

    position: np.ndarray
    error: float
    duration: float


@verb(
    name="robot_move",
    blocks={
        "planner": lib.block("trajectory_planner"),
        "generator": lib.block("setpoint_generator"),
        "near": lib.block("in_position"),
    },
    objects={"arm": each(Joint)},
    instantiation_parameters={
        "arm.commanded": ["planner.start", "generator.setpoint"],
        "arm.goal": ["planner.target", "near.goal"],
        "arm.sensed": "near.sensed",
    },
    cells={"coefficients": ["planner.coefficients", "generator.coefficients"], "complete": ["generator.complete", "near.complete"]},
    input_parameters={
        "goal": input("planner.goal", within=("arm.position_min", "arm.position_max")),
        "speed": "planner.speed",
        "tolerance": "near.tolerance",
        "arm.max_speed": "planner.speed_max",
        "arm.max_acceleration": "planner.acceleration_max",
        "arm.max_jerk": "planner.jerk_max",
        "arm.position_min": "planner.position_min",
        "arm.position_max": "planner.position_max",
    },
    output_values={"position": "near.sensed", "error": "near.error", "duration": "planner.duration"},
    command_lists={"start": [execute("planner"), activate("generator", every="20 ms"), activate("near", every="20 ms")]},
    conditions={"arrived": on("near.done", returns=["position", "error", "duration"]), "time_limit": on(raises=MotionTimeout)},
    requires={"arm.homed": required(NotHomed, when="arm.needs_home", remedy="find its zero first: gpac.motion.home(…) or home_here(…)")},
)
def move(arm: Group[Joint], /, goal: Sequence[float] | np.ndarray, speed: float = 0.5, tolerance: float = 0.002) -> Moved:
    """Moves the joints of an arm, from rest, so that all arrive together. goal: rad, one for each joint; speed: rad/s; tolerance: rad.

    `gpac.motion.move_absolute` does the same from a moving start, with more to choose.
    """
    ...
