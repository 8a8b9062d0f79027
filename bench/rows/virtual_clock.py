# SPDX-License-Identifier: Apache-2.0
"""The virtual clock: the speed of a simulated six-joint arm relative to real time, with servos at 1 kHz and physics."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator

from lines import Line, digits, median

import opengpac as gpac

GOALS = ([30, -70, 70, -60, -90, 20], [0, -90, 90, -90, -90, 0])


def measure(rounds: int) -> Iterator[Line]:
    """Measures the same move in each round, on a new system."""
    try:
        turns = [_move() for _ in range(min(rounds, 5))]
    except ImportError as why:
        yield Line("virtual", "coordinated motion under the virtual clock", bar_text="≥ 20 ×", note=f"not taken: {why}")
        return
    speed = median([moved_s / took_s for moved_s, took_s in turns])
    moved, took = median([turn[0] for turn in turns]), median([turn[1] for turn in turns])
    yield Line(
        "virtual",
        "coordinated motion of six joints, virtual clock",
        f"{digits(took)} s",
        f"real time: {digits(moved)} s",
        speed,
        f"{speed:.0f} ×",
        20.0,
        "≥ 20 ×",
        "enable, five moves there and five back; physics at 1 kHz included",
        at_least=True,
    )


def _move() -> tuple[float, float]:
    arm = gpac.robots.load("ur5e", clock="virtual")
    cell = arm[0].system
    with cell:
        begun = clock.perf_counter()
        arm.enable()
        for goal in GOALS * 5:
            gpac.robots.move(arm, gpac.deg(goal), 1.0)
        return cell.now, clock.perf_counter() - begun
