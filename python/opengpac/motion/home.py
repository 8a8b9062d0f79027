# SPDX-License-Identifier: Apache-2.0
"""Homing: determines the position of a joint from a switch, or from a value passed by the caller."""

from __future__ import annotations

import numpy as np

from .. import library as lib
from ..application.reports import Report
from ..definition.commands import activate, execute
from ..definition.conditions import on
from ..definition.parameters import each, input
from ..definition.verb_decorator import verb
from ..devices.groups import Group
from ..errors import Terminated, TimeLost
from ..robots.generators import PERIOD, Values, brake, gaps, handed, slowing, suspended
from ..robots.joints import Joint
from ..system.svvs import SVV


class HomingFailed(Terminated):
    """The switch was not found within the time limit. The joint has come to rest."""


class Homed(Report):
    """Result of homing a joint: the offset by which its positions were shifted, rad (m)."""

    shift: np.ndarray


_SET = {
    "arm.offset": ["set.offset", "set.new_offset"],
    "arm.homed": "set.homed",
}
_POSITION = input("set.position", within=("arm.position_min", "arm.position_max"))


@verb(
    name="home_here",
    blocks={"set": lib.block("set_position")},
    objects={"arm": each(Joint)},
    instantiation_parameters={
        **_SET,
        "arm.commanded": ["set.commanded", "set.new_commanded"],
        "arm.sensed": "set.captured",
    },
    input_parameters={"position": _POSITION},
    output_values={"shift": "set.shift"},
    command_lists={"start": [execute("set")]},
    conditions={"completed": on(returns=["shift"])},
    manual=True,
)
def home_here(arm: Group[Joint] | Joint, /, position: Values = 0.0) -> Homed:
    """Declares the current positions of the joints to be `position`: rad (m), one for all or one for each joint of `arm`. Nothing moves,
    and the joints are then `homed`."""
    ...


_MOVES = ("seek", "back", "creep", "brake")


@verb(
    name="home",
    blocks={
        "watch": lib.block("capture"),
        "seek": lib.block("velocity_generator"),
        "back": lib.block("velocity_generator")(reverse=True),
        "creep": lib.block("velocity_generator"),
        "brake": brake(),
        "set": lib.block("set_position"),
    },
    objects={"arm": Joint},
    instantiation_parameters={
        **_SET,
        "arm.commanded": [*(f"{label}.{port}" for label in _MOVES for port in ("start", "setpoint")), "set.commanded", "set.new_commanded"],
        **handed(_MOVES, _MOVES),
        "arm.sensed": "watch.u",
        "arm.override": [f"{label}.override" for label in _MOVES[:3]],
        "arm.cell_override": [f"{label}.cell_override" for label in _MOVES[:3]],
        "switch": "watch.level",
    },
    cells={"captured": ["watch.captured", "set.captured"]},
    input_parameters={
        "speed": input("seek.velocity", within=("-arm.max_speed", "arm.max_speed")),
        "creep": input(["back.velocity", "creep.velocity"], within=("-arm.max_speed", "arm.max_speed")),
        "position": _POSITION,
        "arm.max_acceleration": [f"{label}.acceleration" for label in _MOVES],
        "arm.max_jerk": [f"{label}.jerk" for label in _MOVES],
        **gaps(*(f"{label}.gap_max" for label in _MOVES)),
    },
    output_values={"shift": "set.shift"},
    command_lists={
        "seek": [activate("watch", every="1 ms"), activate("seek", every=PERIOD)],
        "back": [activate("watch", every="1 ms"), activate("back", every=PERIOD)],
        "creep": [activate("watch", every="1 ms"), activate("creep", every=PERIOD)],
        "settle": [activate("brake", every=PERIOD)],
        "set": [execute("set")],
        "stop": [activate("brake", every=PERIOD)],
        "give_up": [activate("brake", every=PERIOD)],
    },
    initial="seek",
    conditions={
        "found": on("watch.on", during="seek"),
        "left": on("watch.off", during="back"),
        "touched": on("watch.on", during="creep"),
        "settled": on("brake.stopped", during="settle"),
        "completed": on(returns=["shift"]),
        "stopped": on("brake.stopped", returns=[], during="stop"),
        "not_found": on("brake.stopped", raises=HomingFailed, during="give_up"),
        "time_lost": on([f"{label}.gap" for label in _MOVES[:3]], returns=[], raises=TimeLost, during=["seek", "back", "creep"]),
    },
    transitions={
        ("seek", "found"): "back",
        ("back", "left"): "creep",
        ("creep", "touched"): "settle",
        ("settle", "settled"): "set",
        ("seek", "halted"): "stop",
        ("back", "halted"): "stop",
        ("creep", "halted"): "stop",
        ("seek", "time_limit"): "give_up",
        ("back", "time_limit"): "give_up",
        ("creep", "time_limit"): "give_up",
        ("settle", "halted"): "stop",
        ("settle", "time_limit"): "give_up",
        **slowing("stop", "give_up"),
    },
    suspend=suspended(*_MOVES),
    manual=True,
)
def home(arm: Joint, switch: SVV[bool], /, speed: float | str = "10 %", creep: float | str = "1 %", position: float | str = 0.0) -> Homed:
    """Homes a joint on a switch: moves until the switch is on, back until it is off, and slowly forward until it is on again; the
    position at that edge becomes `position`.

    switch: an SVV of type bool that is true on the switch, or at an index mark; speed: rad/s (m/s) of the search, negative to search
    in the other direction; creep: speed of the slow approach, with the same sign; position: rad (m). When the call returns, the joint
    is `homed`, at rest beyond the edge. A joint that starts on its switch first moves off it.
    """
    ...
