# SPDX-License-Identifier: Apache-2.0
"""Motions to positions: absolute, and relative to the commanded positions."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import library as lib
from ..application.reports import Report
from ..definition.commands import activate
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..errors import Terminated
from ..robots.generators import GAP, HOMED, PERIOD, STOP, Values, bound, brake, limited, share, slowing, suspended
from ..robots.joints import Joint


class MoveTimeout(Terminated):
    """A motion did not end within its time limit. The joints have come to rest short of the goal."""


class Moved(Report):
    """End report of a motion: positions of the joints, maximum distance from a goal, and planned duration (s)."""

    position: np.ndarray
    error: float
    duration: float


_RANGE = ("arm.position_min", "arm.position_max")


def _to(goal: Any, relative: bool) -> dict[str, Any]:
    """Returns the verb mappings of a motion to a goal."""
    return {
        "blocks": {
            "generator": lib.block("motion_generator")(relative=relative),
            "near": lib.block("in_position"),
            "brake": brake(),
        },
        "objects": {"arm": each(Joint)},
        "instantiation_parameters": {
            **bound("generator", "brake", overridden=["generator"], velocity={"generator": "velocity"}),
            "arm.goal": ["generator.target", "near.goal"],
            "arm.sensed": "near.sensed",
        },
        "cells": {"complete": ["generator.complete", "near.complete"]},
        "input_parameters": {
            "goal": goal,
            "speed": share("generator.speed", "max_speed"),
            "acceleration": share("generator.acceleration", "max_acceleration"),
            "tolerance": "near.tolerance",
            "arm.max_acceleration": "brake.acceleration",
            **limited("generator", "brake"),
        },
        "output_values": {"position": "near.sensed", "error": "near.error", "duration": "generator.duration"},
        "command_lists": {
            "start": [activate("generator", every=PERIOD), activate("near", every=PERIOD)],
            "stop": STOP,
            "give_up": STOP,
        },
        "initial": "start",
        "conditions": {
            "arrived": on("near.done", returns=["position", "error", "duration"], during="start"),
            "stopped": on("brake.stopped", returns=["position"], during="stop"),
            "timed_out": on("brake.stopped", returns=["position"], raises=MoveTimeout, during="give_up"),
            **GAP,
        },
        "transitions": {
            ("start", "halted"): "stop",
            ("start", "time_limit"): "give_up",
            **slowing("stop", "give_up"),
        },
        "requires": {"arm.homed": HOMED},
        "suspend": suspended("generator", "brake"),
    }


@verb(name="move_absolute", **_to(input("generator.goal", within=_RANGE), relative=False))
def move_absolute(
    arm: Group[Joint] | Joint,
    /,
    goal: Values | dict[str, float | str],
    speed: Values = "30 %",
    acceleration: Values = "100 %",
    tolerance: float = 0.002,
) -> Moved:
    """Moves joints from rest to positions on a straight line in joint space, so that all arrive together.

    goal: rad (m), one for each joint, within its range; speed: rad/s (m/s) or a fraction of `max_speed`; acceleration: rad/s² or a
    fraction of `max_acceleration`; tolerance: rad, within which all joints must be to report `arrived`.
    """
    ...


@verb(name="move_relative", **_to(input("generator.goal", within=_RANGE, counted_from="arm.commanded"), relative=True))
def move_relative(
    arm: Group[Joint] | Joint,
    /,
    goal: Values,
    speed: Values = "30 %",
    acceleration: Values = "100 %",
    tolerance: float = 0.002,
) -> Moved:
    """Moves joints by `goal` relative to their commanded positions at the start. The other parameters are as in `move_absolute`."""
    ...
