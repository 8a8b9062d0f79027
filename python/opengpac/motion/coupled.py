# SPDX-License-Identifier: Apache-2.0
"""Coupled motion: gears one axis to another."""

from __future__ import annotations

from .. import library as lib
from ..definition.commands import activate
from ..definition.conditions import on
from ..definition.parameters import input
from ..definition.verb_decorator import verb
from ..robots.generators import GAP, PERIOD, STOP, brake, handed, limited, share, slowing
from ..robots.joints import Joint
from ..system.svvs import SVV
from .velocity import LimitReached, Stopped


@verb(
    name="gear",
    blocks={"generator": lib.block("gear_generator"), "brake": brake()},
    objects={"arm": Joint},
    instantiation_parameters={
        "arm.commanded": ["generator.start", "generator.setpoint", "brake.start", "brake.setpoint"],
        **handed(["generator", "brake"], ["generator", "brake"]),
        "master": "generator.master",
    },
    input_parameters={
        "ratio": input("generator.ratio", tunable=True),
        "acceleration": share("generator.acceleration", "max_acceleration"),
        "arm.max_speed": "generator.speed",
        "arm.max_acceleration": ["brake.acceleration", "generator.deceleration"],
        **limited("generator", "brake"),
    },
    output_values={"position": "brake.setpoint"},
    command_lists={"start": [activate("generator", every=PERIOD)], "stop": STOP, "limit": STOP},
    initial="start",
    conditions={
        "at_limit": on("generator.at_limit", during="start"),
        "too_fast": on("generator.too_fast", during="start"),
        "limit_reached": on("brake.stopped", returns=["position"], raises=LimitReached, during="limit"),
        "stopped": on("brake.stopped", returns=["position"], during="stop"),
        **GAP,
    },
    transitions={
        ("start", "halted"): "stop",
        ("start", "time_limit"): "stop",
        ("start", "at_limit"): "limit",
        ("start", "too_fast"): "limit",
        **slowing("stop", "limit"),
    },
)
def gear(arm: Joint, master: SVV[float], /, ratio: float = 1.0, acceleration: float | str = "100 %") -> Stopped:
    """Couples a joint to a position: the joint moves at `ratio` times the speed of `master`, until the verb is halted or reaches its
    time limit.

    arm: the joint that follows; master: an SVV, for example `arm[0].commanded`; ratio: negative for the opposite direction, can be
    set while it runs; acceleration: rad/s² (m/s²) while synchronising, or a fraction of `max_acceleration`. Only the speeds are
    coupled: the positions keep their relation once the joint is synchronised. A joint that reaches the end of its range, or would
    exceed `max_speed`, is stopped, and `LimitReached` is raised.
    """
    ...
