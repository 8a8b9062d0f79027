# SPDX-License-Identifier: Apache-2.0
"""Motions at a velocity, and deceleration to a stop."""

from __future__ import annotations

from collections.abc import Mapping
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
from ..robots.generators import GAP, PERIOD, STOP, Values, bound, brake, limited, share, slowing, suspended
from ..robots.joints import Joint
from ..system.svvs import SVV


class LimitReached(Terminated):
    """A joint that moved at a velocity, or in gear, has come to rest because it reached the end of its range, or because its master was
    too fast."""


class Stopped(Report):
    """End report of a motion that came to a stop: the commanded positions."""

    position: np.ndarray


def _at(most: str, *, inputs: Mapping[str, str] | None = None, **more: str) -> dict[str, Any]:
    """Returns the mappings of a motion at a velocity, up to the limit `most` of each joint; `inputs` and `more` are further inputs and
    instantiation parameters."""
    return {
        "objects": {"arm": each(Joint)},
        "instantiation_parameters": {**bound("generator", "brake", overridden=["generator"]), **more},
        "input_parameters": {
            "velocity": input("generator.velocity", within=(f"-arm.{most}", f"arm.{most}"), tunable=True),
            "acceleration": share(["generator.acceleration", "brake.acceleration"], "max_acceleration"),
            **limited("generator", "brake"),
            **(inputs or {}),
        },
        "output_values": {"position": "brake.setpoint"},
    }


@verb(
    name="move_velocity",
    **_at("max_speed"),
    blocks={"generator": lib.block("velocity_generator"), "brake": brake()},
    command_lists={"start": [activate("generator", every=PERIOD)], "stop": STOP, "limit": STOP},
    initial="start",
    conditions={
        "at_limit": on("generator.at_limit", during="start"),
        "limit_reached": on("brake.stopped", returns=["position"], raises=LimitReached, during="limit"),
        "stopped": on("brake.stopped", returns=["position"], during="stop"),
        "halted": on(returns=["position"]),
        **GAP,
    },
    transitions={
        ("start", "halted"): "stop",
        ("start", "time_limit"): "stop",
        ("start", "at_limit"): "limit",
        **slowing("stop", "limit"),
    },
    suspend=suspended("generator", "brake"),
)
def move_velocity(arm: Group[Joint] | Joint, /, velocity: Values, acceleration: Values = "100 %") -> Stopped:
    """Moves joints at a velocity until the verb is halted or reaches its time limit, then stops them; `vi.set(velocity=…)` changes the
    velocity.

    velocity: rad/s (m/s), one for each joint, within plus and minus `max_speed`, or a fraction of it; acceleration: rad/s² or a
    fraction of `max_acceleration`. A joint that reaches the end of its range stops there, and `LimitReached` is raised.
    """
    ...


@verb(
    name="jog",
    manual=True,
    **_at("jog_speed", inputs={"client": "watch.client"}, heartbeat="watch.beat"),
    blocks={"generator": lib.block("velocity_generator"), "brake": brake(), "watch": lib.block("heartbeat")},
    command_lists={"start": [activate("watch", every=PERIOD), activate("generator", every=PERIOD)], "stop": STOP},
    initial="start",
    conditions={
        "released": on("watch.late", during="start"),
        "stopped": on("brake.stopped", returns=["position"], during="stop"),
        "halted": on(returns=["position"]),
        **GAP,
    },
    transitions={
        ("start", "released"): "stop",
        ("start", "halted"): "stop",
        ("start", "time_limit"): "stop",
        **slowing("stop"),
    },
    suspend=suspended("generator", "brake"),
)
def jog(arm: Group[Joint] | Joint, heartbeat: SVV[int], /, velocity: Values, acceleration: Values = "50 %", client: int = 0) -> Stopped:
    """Moves joints at a reduced velocity while a button is held, that is, as long as `heartbeat` changes.

    heartbeat: an SVV of type int that must be set to a new number at intervals of less than 0.25 s; otherwise the joints stop and the
    verb ends. velocity: rad/s (m/s), within plus and minus `jog_speed`, can be set while it runs. client: if several clients write to
    `heartbeat`, the number of the client that holds the button, 1 to 2^31 - 1; only the numbers of that client are accepted, from
    client * 2^20 to client * 2^20 + 2^20 - 1. A joint stops at the end of its range, and can be moved back.
    """
    ...


@verb(
    name="stop",
    manual=True,
    blocks={"brake": brake()},
    objects={"arm": each(Joint)},
    instantiation_parameters=bound("brake"),
    input_parameters={"deceleration": share("brake.acceleration", "max_acceleration"), **limited("brake")},
    output_values={"position": "brake.setpoint"},
    command_lists={"stop": STOP},
    conditions={"stopped": on("brake.stopped", returns=["position"])},
    transitions=slowing("stop"),
    suspend=suspended("brake"),
)
def stop(arm: Group[Joint] | Joint, /, deceleration: Values = "100 %") -> Stopped:
    """Brings joints to rest at `deceleration`: rad/s² (m/s²), or a fraction of `max_acceleration`."""
    ...
