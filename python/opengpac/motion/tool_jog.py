# SPDX-License-Identifier: Apache-2.0
"""Jogs the tool of an arm along and about the axes of its base or of the tool."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import library as lib
from ..definition.commands import activate, execute
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..errors import Terminated
from ..robots.generators import GAP, HOMED, PERIOD, gaps, handed, slowing, suspended
from ..robots.joints import Joint
from ..system.svvs import SVV
from .velocity import Stopped

SPEED_MAX = 0.25
"""Maximum speed along each axis, m/s: the reduced speed of ISO 10218-1."""

ANGULAR_SPEED_MAX = 1.0
"""Maximum speed about each axis, rad/s."""

_REST = [execute("hold"), activate("generator", every=PERIOD)]


class JogBlocked(Terminated):
    """The tool has come to rest because it cannot continue in that direction. `value` is the index of the joint at the end of its range,
    or -1.

    `joint` is the name of that joint, or None if the arm is near a singularity or at the end of its reach. It can be jogged back.
    """

    joint: str | None = None

    def explanation(self) -> str:
        """Returns the reason, including the joint and its range."""
        number = int(self.value) if self.value is not None else -1
        if number < 0:
            return "the arm is near a singularity or at the end of its reach; jog in another direction, or move a joint"
        if "arm" not in self.objects:
            return f"joint {number} (counted from 0) is at the end of its range; jog back, or move this joint alone"
        joint = self.objects["arm"][number]
        self.joint = joint.short_name
        return (
            f"joint '{self.joint}' is at the end of its range, {joint.position_min:.6g} to {joint.position_max:.6g}; "
            "jog back, or move this joint alone"
        )


@verb(
    name="jog_linear",
    manual=True,
    blocks={"generator": lib.block("tool_velocity_generator"), "watch": lib.block("heartbeat"), "hold": lib.block("flag")},
    objects={"arm": each(Joint)},
    instantiation_parameters={
        "arm.commanded": ["generator.start", "generator.setpoint"],
        **handed(["generator"], ["generator"]),
        "arm.override": "generator.override",
        "arm.cell_override": "generator.cell_override",
        "heartbeat": "watch.beat",
    },
    cells={"holding": ["hold.y", "generator.holding"]},
    input_parameters={
        "velocity": input("generator.velocity", within=(-SPEED_MAX, SPEED_MAX), tunable=True),
        "angular_velocity": input("generator.angular_velocity", within=(-ANGULAR_SPEED_MAX, ANGULAR_SPEED_MAX), tunable=True),
        "in_tool": "generator.in_tool",
        "distance": "generator.distance",
        "acceleration": "generator.acceleration",
        "client": "watch.client",
        "chain": input("generator.chain", member="arm.chain"),
        "arm.jog_speed": "generator.speed_max",
        "arm.max_acceleration": "generator.acceleration_max",
        "arm.max_jerk": "generator.jerk_max",
        "arm.position_min": "generator.position_min",
        "arm.position_max": "generator.position_max",
        **gaps("generator.gap_max"),
    },
    output_values={"position": "generator.setpoint"},
    command_lists={"start": [activate("watch", every=PERIOD), activate("generator", every=PERIOD)], "stop": _REST},
    initial="start",
    conditions={
        "arrived": on("generator.finished", returns=["position"], during="start"),
        "released": on("watch.late", during="start"),
        "stopped": on("generator.held", returns=["position"], during="stop"),
        "blocked": on("generator.blocked", returns=["position"], raises=JogBlocked, during="start"),
        **GAP,
    },
    transitions={
        ("start", "released"): "stop",
        ("start", "halted"): "stop",
        ("start", "time_limit"): "stop",
        **slowing("stop"),
    },
    requires={"arm.homed": HOMED},
    suspend=suspended("generator"),
)
def jog_linear(
    arm: Group[Joint],
    heartbeat: SVV[int],
    /,
    velocity: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
    angular_velocity: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
    in_tool: bool = False,
    distance: float = 0.0,
    acceleration: float = 0.5,
    client: int = 0,
) -> Stopped:
    """Moves the tool straight along and about the axes of the arm's base while a button is held, that is, as long as `heartbeat`
    changes.

    heartbeat, client: as in `jog`; velocity: m/s along x, y and z, at most 0.25; angular_velocity: rad/s about them, at most 1; both
    can be set while it runs; in_tool: the axes are those of the tool at the start; distance: m, or rad if the tool only turns, after
    which the verb ends with `arrived`, 0 for unlimited; acceleration: m/s²; the angular acceleration is five times this number, in
    rad/s². No joint exceeds its `jog_speed`. At the end of a range, and near a singularity, the tool slows down and comes to rest on
    its line, and `JogBlocked` is raised; it can be moved back.
    """
    ...
