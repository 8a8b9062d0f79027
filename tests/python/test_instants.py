# SPDX-License-Identifier: Apache-2.0
"""Instants of the virtual clock: `advance(d)` covers the firings in (now, now + d], a firing with a cost is visible at its end, and an
endless sequence of requests at one instant is refused."""

from __future__ import annotations

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from rig import Rig


@pytest.mark.parametrize("seed", range(4))
def test_an_output_is_seen_when_its_invocation_is_over_and_not_before(built: dict[str, str], seed: int) -> None:
    with gpac.System("cell", clock="virtual", seed=seed, progress=False) as cell:
        rig = Rig(cell, built)
        long = rig.rtp.timer("long", period="10 ms", priority=10, virtual_cost="4 ms")
        a, b = cell.svv("a", history=100), cell.svv("b", history=100)
        rig.counting("slowly", every="10 ms").on(long).asynch(a)
        rig.counting("quickly").on(rig.fast).asynch(b)
        seen = []
        for ms in range(1, 25):
            cell.advance("1 ms")
            assert (cell.now, b.number) == (pytest.approx(ms * 1e-3), ms - 1), "time is as it was asked for, and the fast source keeps it"
            seen.append(len(a.history))
        assert seen == [0] * 13 + [1] * 10 + [2]
        assert a.history[:]["time"].tolist() == [0.01, 0.02]


def test_a_firing_that_is_not_over_takes_commands_at_its_end(memory_rig: Rig) -> None:
    rig = memory_rig
    long = rig.rtp.timer("long", period="10 ms", priority=10, virtual_cost="4 ms")
    low = rig.rtp.timer("low", period="1 ms", priority=5)
    u, y, n = rig.svvs("u", "y", "n")
    through = gpac.Verb(
        "through",
        blocks={"gain": lib.gain(k=2.0)},
        instantiation_parameters={"u": "gain.u", "y": "gain.y"},
        modes={"gain.u": "asynchronous"},
        command_lists={"start": [activate("gain", every="10 ms")]},
    )
    u.value = 1.0
    vi = through.on(long).asynch(u, y)
    rig.counting("counting").on(low).asynch(n)
    rig.cell.advance("12 ms")
    assert (n.value, y.value) == (8, 0.0), "a source of lower priority is held up from 10 ms on"
    assert rig.cell.now == pytest.approx(0.012), "who looks moves no time"
    vi.halt()
    assert (rig.cell.now, y.value, y.number) == (pytest.approx(0.014), 2.0, 0), "the invocation in flight finishes and publishes"
    rig.cell.advance("6 ms")
    assert (rig.cell.now, n.value) == (pytest.approx(0.020), 14), "of the five releases that were held up only the last is made"


def test_a_wait_leaves_nothing_of_its_instant_to_the_next_advance(memory_rig: Rig) -> None:
    rig = memory_rig
    later = rig.rtp.timer("later", period="1 ms", priority=20)
    y, n = rig.svvs("y", "n")
    rig.counting("beside").on(later).asynch(n)
    for limit in (3, 4):
        rig.counting().on(rig.fast)(y, limit=limit)
        before, now = n.value, rig.cell.now
        assert now == pytest.approx((before + 1) * 1e-3), "all of the instant has happened"
        rig.cell.advance("1 ms")
        assert (n.value - before, rig.cell.now) == (1, pytest.approx(now + 1e-3))
    rig.cell.advance(until=y > -1.0)
    before = n.value
    rig.cell.advance(until=n > before)
    rig.cell.advance("2 ms")
    assert n.value == before + 3


def test_requests_without_end_at_one_instant_are_refused_and_everything_else_works(memory_rig: Rig) -> None:
    rig = memory_rig
    trigger = rig.rtp.trigger("trigger", priority=30)
    driven = rig.rtp.software("driven", priority=40)
    t, u, n = rig.cell.svv("t"), rig.cell.svv("u"), rig.cell.svv("n", "int64_t")
    counting = rig.counting("triggered", command_lists={"start": [activate("count")]}).on(trigger).asynch(t)
    for _ in range(10_000):
        trigger.request()
    with pytest.raises(gpac.Error, match=r"'rtp0\.trigger' cannot be requested again: 10,000 requests already wait .*let time pass"):
        trigger.request()
    rig.cell.advance("1 ms")
    assert (t.value, rig.cell.now) == (9999, pytest.approx(1e-3))
    counting.halt()
    chain = gpac.Verb(
        "chain",
        blocks={"count": rig.block("count.count"), "copy": rig.block("copy.copy")},
        instantiation_parameters={"y": "copy.y", "n": "copy.n"},
        cells={"c": ["count.y", "copy.u"]},
        command_lists={"start": [activate("count"), activate("copy")]},
    )
    following = chain.on({"count": trigger, "copy": driven}).asynch(u, n)
    for _ in range(6000):
        trigger.request()
    with pytest.raises(gpac.Error, match=r"more than 10000 requested firings .* requests are refused"):
        rig.cell.advance("1 ms")
    rig.cell.advance("1 ms")
    following.halt()
    rig.cell.reset()
    assert rig.counting("after").on(rig.fast)(rig.cell.svv("after"), limit=3).last == 3
    trigger.request()
    rig.cell.advance("1 ms")
