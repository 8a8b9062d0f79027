# SPDX-License-Identifier: Apache-2.0
"""Example from the paper: coordinated motion of the joints of an arm, all arriving together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import library as lib
from ..application.reports import Report
from ..definition.commands import activate
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..errors import Terminated
from .generators import GAP, HOMED, PERIOD, STOP, bound, brake, limited, slowing, suspended
from .joints import Joint


class MotionTimeout(Terminated):
    """A motion did not end within its time limit. The joints have come to rest short of the goal."""


class Moved(Report):
    """End report of a motion: positions of the joints (rad), maximum distance from a goal (rad), and planned duration (s)."""

    position: np.ndarray
    error: float
    duration: float


@verb(
    name="robot_move",
    blocks={"generator": lib.block("motion_generator"), "near": lib.block("in_position"), "brake": brake()},
    objects={"arm": each(Joint)},
    instantiation_parameters={
        **bound("generator", "brake", overridden=["generator"], velocity={"generator": "velocity"}),
        "arm.goal": ["generator.target", "near.goal"],
        "arm.sensed": "near.sensed",
    },
    cells={"complete": ["generator.complete", "near.complete"]},
    input_parameters={
        "goal": input("generator.goal", within=("arm.position_min", "arm.position_max")),
        "speed": "generator.fastest",
        "tolerance": "near.tolerance",
        "arm.max_speed": "generator.speed",
        "arm.max_acceleration": ["generator.acceleration", "brake.acceleration"],
        **limited("generator", "brake"),
    },
    output_values={"position": "near.sensed", "error": "near.error", "duration": "generator.duration"},
    command_lists={
        "start": [activate("generator", every=PERIOD), activate("near", every=PERIOD)],
        "stop": STOP,
        "give_up": STOP,
    },
    initial="start",
    conditions={
        "arrived": on("near.done", returns=["position", "error", "duration"], during="start"),
        "stopped": on("brake.stopped", returns=["position"], during="stop"),
        "timed_out": on("brake.stopped", returns=["position"], raises=MotionTimeout, during="give_up"),
        **GAP,
    },
    transitions={
        ("start", "halted"): "stop",
        ("start", "time_limit"): "give_up",
        **slowing("stop", "give_up"),
    },
    requires={"arm.homed": HOMED},
    suspend=suspended("generator", "brake"),
)
def move(arm: Group[Joint], /, goal: Sequence[float] | np.ndarray, speed: float = 0.5, tolerance: float = 0.002) -> Moved:
    """Moves the joints of an arm so that all arrive together. goal: rad, one for each joint; speed: rad/s; tolerance: rad.

    `gpac.motion.move_absolute` does the same with more options.
    """
    ...
