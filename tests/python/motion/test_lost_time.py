# SPDX-License-Identifier: Apache-2.0
"""Lost time is not made up for: whatever is late, the speed asked for is kept, and a gap beyond the joints' bound brings them to rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from axes import late, machine
from opengpac import activate, motion
from opengpac.robots import Joint

Axes = gpac.Group[Joint]
ASKED = 0.3

MOTIONS: dict[str, Callable[[Axes], gpac.VerbInstance[Any]]] = {
    "move_absolute": lambda axes: motion.move_absolute.asynch(axes, 0.6, speed=ASKED),
    "move_velocity": lambda axes: motion.move_velocity.asynch(axes, ASKED, time_limit="3 s"),
    "follow": lambda axes: motion.follow.asynch(axes, [[0.3, 0.3], [0.6, 0.6]], speed=ASKED),
    "robots.move": lambda axes: gpac.robots.move.asynch(axes, [0.6, 0.6], speed=ASKED),
    "gear": lambda axes: motion.gear.asynch(axes[0], axes[1].commanded, time_limit="3 s"),
}

@pytest.fixture(params=[50, 100, 300, 480])
def bounded(request: pytest.FixtureRequest) -> Iterator[tuple[Axes, Callable[[], None]]]:
    """Two axes, and a gap that their bound allows."""
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        yield machine(cell, on=rtp), late(rtp, request.param)


@pytest.mark.parametrize("of", MOTIONS)
@pytest.mark.parametrize("after", ["90 ms", "700 ms", "1.91 s"])
def test_the_speed_asked_for_is_kept(bounded: tuple[Axes, Callable[[], None]], of: str, after: str) -> None:
    axes, keep = bounded
    if of == "gear":
        motion.move_velocity.asynch(axes[1], ASKED, time_limit="3 s")
    moving = MOTIONS[of](axes)
    axes.system.advance(after)
    keep()
    axes.system.advance("8 s")
    assert moving.done and moving.report.condition in ("arrived", "stopped")
    for joint in axes:
        rows = joint.reference.history[:]
        step = np.abs(np.diff(rows["value"]))
        assert np.diff(rows["number"]).max() > 20, "releases were skipped"
        assert step.max() <= ASKED * 1e-3 * (1 + 1e-6), f"{step.max() / 1e-3} rad/s"


@pytest.mark.parametrize("of", MOTIONS)
def test_a_gap_beyond_the_bound_brings_the_joints_to_rest_and_tells_its_length(of: str) -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_following_error=1.0), late(rtp, 2000)
        if of == "gear":
            motion.move_velocity.asynch(axes[1], ASKED, time_limit="3 s")
        moving = MOTIONS[of](axes)
        cell.advance("700 ms")
        keep()
        cell.advance("5 s")
        with pytest.raises(motion.TimeLost, match=r"1\.9[0-9]* s were lost at once, more than max_gap \(0\.5 s\) allows") as lost:
            moving.wait()
        assert 1.9 < lost.value.value <= 2.0
        assert axes[0].commanded_velocity.value == 0.0
        assert axes[0].commanded.value < 0.3, "it has not gone on"


def test_the_bound_is_declared_for_each_joint() -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_gap=0.05), late(rtp, 100)
        moving = motion.move_absolute.asynch(axes, 0.6)
        cell.advance("300 ms")
        keep()
        with pytest.raises(motion.TimeLost):
            moving.wait()


def test_a_rate_limiter_and_an_integrator_do_not_leap() -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        fast, keep = rtp.timer("fast", period="1 ms", priority=80), late(rtp, 500)
        lib = gpac.library
        ramp = gpac.Verb(
            "ramp",
            blocks={"limit": lib.rate_limiter, "sum": lib.integrator},
            instantiation_parameters={"u": ["limit.u", "sum.u"], "y": "limit.y", "total": "sum.y"},
            modes={"limit.u": "asynchronous", "sum.u": "asynchronous"},
            command_lists={"start": [activate("limit", every="1 ms"), activate("sum", every="1 ms")]},
        )
        u = cell.svv("in", float)
        y, total = cell.svv("out", float, history=5000), cell.svv("total", float, history=5000)
        ramp.on(fast).asynch(u, y, total)
        cell.advance("10 ms")
        u.value = 100.0
        cell.advance("100 ms")
        keep()
        cell.advance("1 s")
        assert np.abs(np.diff(y.history[:]["value"])).max() <= 1e-3 * (1 + 1e-9)
        assert np.abs(np.diff(total.history[:]["value"])).max() <= 0.1 * (1 + 1e-9)
