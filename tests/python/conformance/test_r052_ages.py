# SPDX-License-Identifier: Apache-2.0
"""Requirement 52 with DESIGN 2.6: late values are counted, and raise a condition if a limit is declared."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate
from rig import Rig


def link(delay_ms: float, least_ms: float = 0.0) -> dict[str, Any]:
    """Returns a message link with a delay of up to `delay_ms`."""
    return {"kind": "message", "seed": 3, "delay_ns": [round(least_ms * 1_000_000), round(delay_ms * 1_000_000)]}


def sampling(rig: Rig) -> gpac.Verb[..., Any]:
    """Returns a verb that takes the newest value."""
    return gpac.Verb(
        "sampling",
        blocks={"s": rig.block("copy.sample")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s", every="1 ms")]},
    )


@pytest.mark.parametrize(("delay_ms", "age_max", "lost"), [(1.0, "5 ms", False), (40.0, "5 ms", True), (40.0, None, False)])
def test_r052_a_link_that_brings_nothing_for_too_long_is_lost(
    built: dict[str, str], delay_ms: float, age_max: str | None, lost: bool
) -> None:
    with gpac.System("cell", clock="virtual", interconnect=link(delay_ms, delay_ms)) as cell:
        rig = Rig(cell, built)
        other = cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
        a, b = rig.svvs("a", "b")
        rig.counting().on(rig.fast).asynch(a)
        vi = sampling(rig).on(other).asynch(a, b, age_max=age_max)
        cell.advance("500 ms")
        assert (vi.state == "ended") == lost
        if lost:
            with pytest.raises(
                gpac.Terminated, match=r"no value from 'rtp0\.fast' has arrived at 'rtp1\.fast' for more than 0\.005"
            ) as end:
                vi.wait()
            assert end.value.condition == "link_lost"


def test_r052_a_lost_link_may_have_a_transition(built: dict[str, str]) -> None:
    with gpac.System("cell", clock="virtual", interconnect=link(40.0, 40.0)) as cell:
        rig = Rig(cell, built)
        other = cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
        a, b, c = rig.svvs("a", "b", "c")
        verb = gpac.Verb(
            "guarded",
            blocks={"s": rig.block("copy.sample"), "alone": rig.block("count.count")},
            instantiation_parameters={"u": "s.u", "y": "s.y", "c": "alone.y"},
            command_lists={"start": [activate("s", every="1 ms")], "alone": [activate("alone", every="1 ms")]},
            initial="start",
            conditions={"link_lost": gpac.on()},
            transitions={("start", "link_lost"): "alone"},
        )
        rig.counting().on(rig.fast).asynch(a)
        vi = verb.on(other).asynch(a, b, c, age_max="5 ms")
        cell.advance("500 ms")
        assert vi.state == "running" and c.value > 0


def slow_reading(rig: Rig) -> gpac.Verb[..., Any]:
    """Returns a verb that takes a value updated once in ten of its invocations."""
    return gpac.Verb(
        "slow_reading",
        blocks={"r": rig.block("ratio.slow_input")},
        instantiation_parameters={"u": "r.u", "y": "r.y", "n": "r.n"},
        command_lists={"start": [activate("r", every="1 ms")]},
    )


@pytest.mark.parametrize(("delay_ms", "late"), [(0.5, False), (120.0, True)])
def test_r052_ratio_values_that_come_late_are_counted(built: dict[str, str], delay_ms: float, late: bool) -> None:
    with gpac.System("cell", clock="virtual", interconnect=link(delay_ms)) as cell:
        rig = Rig(cell, built)
        other = cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
        slow, y, n = rig.svvs("slow", "y", "n")
        rig.counting("slowly", every="10 ms").on(rig.slow).asynch(slow)
        vi = slow_reading(rig).on(other).asynch(slow, y, n)
        cell.advance("1 s")
        assert (cell.statistics["sources"]["rtp1.fast"]["late"] > 0) == late
        assert vi.state == "running", "without a limit it is only counted"


def test_r052_a_ratio_value_that_is_absent_for_too_long_ends_its_reader(rig: Rig) -> None:
    slow, y, n = rig.svvs("slow", "y", "n")
    writer = rig.counting("slowly", every="10 ms").on(rig.slow).asynch(slow)
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    vi = slow_reading(rig).on(other).asynch(slow, y, n, age_max="20 ms")
    rig.cell.advance("1 s")
    assert vi.state == "running"
    writer.halt()
    rig.cell.advance("50 ms")
    with pytest.raises(
        gpac.Terminated, match=r"a ratio value from 'rtp0\.slow' to 'rtp1\.fast' has been missing for more than 0\.02 s"
    ) as end:
        vi.wait()
    assert end.value.condition == "late" and 1.02 < end.value.time < 1.04


def test_r052_an_age_that_no_writer_can_keep_is_refused(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    rig.counting(every="10 ms").on(rig.slow).asynch(a)
    with pytest.raises(
        gpac.ValueRefused, match=r"age_max 0\.005 s: source 'rtp0\.slow', which it reads, publishes every 0\.01 s; give a longer"
    ):
        sampling(rig).on(rig.fast).asynch(a, b, age_max="5 ms")
    assert sampling(rig).on(rig.fast).asynch(a, b, age_max="30 ms").state == "running"
