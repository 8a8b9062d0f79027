# SPDX-License-Identifier: Apache-2.0
"""Homing: an unhomed joint refuses moves to positions until a switch or a person has set its position."""

from __future__ import annotations

import pytest

import opengpac as gpac
from axes import Watch
from opengpac import motion
from opengpac.robots import Joint

SWITCH_AT = 0.37
"""Position of the switch by the encoder: on beyond it."""


def switched(axes: gpac.Group[Joint]) -> gpac.SVV[bool]:
    """Returns a switch that is on when the first axis is beyond its position; starts the verb that reports it."""
    cell = axes.system
    level = cell.svv("switch", bool)
    where = cell.svv("where", "double")
    code = cell.download("switch.c")
    sense = gpac.Verb(
        "sense",
        blocks={"switch": code.switch},
        instantiation_parameters={"q": "switch.q", "offset": "switch.offset", "level": "switch.level", "where": "switch.where"},
        command_lists={"start": [gpac.activate("switch", every="1 ms")]},
    )
    sense.asynch(axes[0].sensed, axes[0].offset, level, where)
    return level


@pytest.fixture
def _switch_c(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(str(tmp_path))
    with open("switch.c", "w") as file:
        file.write(f"""// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(switch, "A switch: level = q - offset > {SWITCH_AT}.",
    in_async(double, q,      "position",                    "rad"),
    in_async(double, offset, "what was added to it",        "rad"),
    out     (double, where,  "position by the encoder",     "rad"),
    out     (bool,   level,  "whether it is beyond its place"))
{{
    self->where = self->q - self->offset;
    self->level = self->where > {SWITCH_AT};
    return OK;
}}
""")


def test_moves_to_positions_need_a_home(unhomed: gpac.Group[Joint]) -> None:
    axes = unhomed
    assert axes.values("homed") == [False, False]
    for verb in (motion.move_absolute, motion.move_relative):
        with pytest.raises(gpac.NotHomed, match=r"'axes.x.homed' is not true; home it first"):
            verb(axes, [0.1, 0.1])
    with pytest.raises(gpac.NotHomed):
        gpac.robots.move(axes, [0.1, 0.1])
    assert axes.values("commanded") == [0.0, 0.0]
    motion.move_velocity(axes, 0.1, time_limit="0.5 s")
    watch = Watch(axes).run(500)
    report = motion.home_here(axes, [1.0, -1.0])
    watch.run(100)
    assert axes.values("homed") == [True, True] and axes.values("sensed") == pytest.approx([1.0, -1.0], abs=1e-3)
    assert list(report.shift) == pytest.approx(axes.values("offset"))
    assert axes.values("commanded_velocity") == [0.0, 0.0], "nothing moves"
    motion.move_absolute(axes, [0.5, 0.5])
    assert axes.values("commanded") == [0.5, 0.5]


def test_a_joint_that_needs_no_home_moves_at_once(axes: gpac.Group[Joint]) -> None:
    assert axes[0].homed.value is False
    motion.move_absolute(axes, 0.1)


@pytest.mark.usefixtures("_switch_c")
@pytest.mark.parametrize("begins", [0.0, 0.6])
def test_a_joint_finds_its_switch(unhomed: gpac.Group[Joint], begins: float) -> None:
    axes = unhomed
    level = switched(axes)
    if begins:
        motion.move_velocity(axes[0], 1.0, time_limit=begins)
        assert level.value
    watch = Watch(axes)
    homing = motion.home.asynch(axes[0], level, speed=0.4, creep=0.02, position=0.25)
    watch.run(30_000, until=lambda: homing.done)
    report = homing.wait()
    assert report.condition == "completed" and axes[0].homed.value
    # The servo reads the switch a few ms after the axis has passed it, at 0.02 rad/s.
    assert axes[0].offset.value == pytest.approx(0.25 - SWITCH_AT, abs=2e-4)
    assert list(report.shift) == pytest.approx([axes[0].offset.value])
    axes.system.advance("5 ms")
    before = axes[0].sensed.value
    axes.system.advance("100 ms")
    assert axes[0].sensed.value == pytest.approx(before, abs=1e-3)
    motion.move_absolute(axes[0], 0.0)
    assert axes[0].commanded.value == 0.0 and axes.system._svv("where").value == pytest.approx(SWITCH_AT - 0.25, abs=3e-3)


@pytest.mark.usefixtures("_switch_c")
def test_homing_that_is_halted_or_late_comes_to_rest_and_is_not_homed(unhomed: gpac.Group[Joint]) -> None:
    axes = unhomed
    level = switched(axes)
    watch = Watch(axes)
    homing = motion.home.asynch(axes[0], level, speed=-0.4, creep=-0.02)
    watch.run(400)
    homing.halt()
    watch.run(300).smooth()
    assert axes[0].commanded_velocity.value == 0.0 and not axes[0].homed.value
    with pytest.raises(motion.HomingFailed):
        motion.home(axes[0], level, speed=-0.4, creep=-0.02, time_limit="1 s")
    assert not axes[0].homed.value
