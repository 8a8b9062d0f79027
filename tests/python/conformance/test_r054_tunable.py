# SPDX-License-Identifier: Apache-2.0
"""Requirements 48 and 54: intervals and parameters declared tunable change while the verb runs, and the rates hold throughout."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, interval
from rig import Rig


def counting(rig: Rig, name: str = "counting", every: str = "4 ms") -> gpac.Verb[..., Any]:
    """Returns a verb that counts into `y` at a tunable interval."""
    return rig.counting(name, command_lists={"start": [activate("count", every=interval(every, tunable=True))]})


def rows(svv: gpac.SVV[Any]) -> list[tuple[int, int]]:
    """Returns the number and time in ms of every value."""
    return [(int(row["number"]), round(float(row["time"]) * 1000)) for row in svv.history[:]]


def test_r054_an_interval_changes_at_the_next_multiple_of_the_new_one(rig: Rig) -> None:
    y = rig.cell.svv("y", history=100)
    vi = counting(rig).on(rig.fast).asynch(y)
    rig.cell.advance("10 ms")
    vi.set(every={"count": "5 ms"})
    rig.cell.advance("12 ms")
    vi.set(every={"count": "2 ms"})
    rig.cell.advance("3 ms")
    assert rows(y) == [(0, 4), (1, 8), (2, 15), (3, 20), (4, 24)]


@pytest.mark.parametrize("seed", range(8))
def test_r054_no_invocation_is_lost_or_doubled_whenever_intervals_change(rig: Rig, seed: int) -> None:
    chosen = random.Random(seed)
    y = rig.cell.svv("y", history=2000)
    vi = counting(rig).on(rig.fast).asynch(y)
    expected, every, now, stopped = [], 4, 0, False
    for _ in range(60):
        ms = chosen.randint(1, 13)
        if not stopped:
            expected += [t for t in range(now + 1, now + ms + 1) if t % every == 0]
        rig.cell.advance(f"{ms} ms")
        now += ms
        if chosen.random() < 0.2:
            (vi.resume if stopped else vi.suspend)()
            stopped = not stopped
        if chosen.random() < 0.7:
            every = chosen.randint(1, 9)
            vi.set(every={"count": f"{every} ms"})
    assert rows(y) == list(enumerate(expected))


def test_r054_the_next_start_has_the_declared_interval(rig: Rig) -> None:
    y = rig.cell.svv("y", history=100)
    vi = counting(rig).on(rig.fast).new_instance(y)
    for _ in range(2):
        vi.start()
        rig.cell.advance("8 ms")
        vi.set(every={"count": "1 ms"})
        rig.cell.advance("4 ms")
        vi.halt()
        vi.wait()
    assert [time for _, time in rows(y)] == [4, 8, 9, 10, 11, 12, 16, 20, 21, 22, 23, 24]


def ratio_verb(rig: Rig, name: str = "reading") -> gpac.Verb[..., Any]:
    """Returns a verb that takes a value updated once in ten of its invocations."""
    return gpac.Verb(
        name,
        blocks={"r": rig.block("ratio.slow_input")},
        instantiation_parameters={"u": "r.u", "y": "r.y", "n": "r.n"},
        command_lists={"start": [activate("r", every=interval("1 ms", tunable=True))]},
    )


def test_r054_a_rate_that_could_not_hold_is_refused_with_both_ends(rig: Rig) -> None:
    slow, y, n = rig.svvs("slow", "y", "n", history=200)
    writer = counting(rig, "slowly", "10 ms").on(rig.slow).asynch(slow)
    reader = ratio_verb(rig).on(rig.fast).asynch(slow, y, n)
    rig.cell.advance("30 ms")
    with pytest.raises(gpac.SchedulingError, match=r"'r\.u'.* ratio 10 and runs every 1 ms.*slowly#1.count.y' updates every 20 ms"):
        writer.set(every={"count": "20 ms"})
    with pytest.raises(gpac.SchedulingError, match=r"runs every 2 ms.*updates every 10 ms: it would have to update every 20 ms"):
        reader.set(every={"r": "2 ms"})
    rig.cell.advance("30 ms")
    assert [time for _, time in rows(slow)] == [10, 20, 30, 40, 50, 60], "what was refused has changed nothing"
    assert y.history[:]["value"].tolist() == [max(0.0, j // 10 - 1) for j in range(60)]


def test_r054_several_intervals_change_as_one(rig: Rig) -> None:
    slow, y, n = rig.svvs("slow", "y", "n", history=200)
    verb = gpac.Verb(
        "both",
        blocks={"count": rig.block("count.count"), "r": rig.block("ratio.slow_input")},
        instantiation_parameters={"slow": ["count.y", "r.u"], "y": "r.y", "n": "r.n"},
        command_lists={
            "start": [
                activate("count", every=interval("10 ms", tunable=True)),
                activate("r", every=interval("1 ms", tunable=True)),
            ]
        },
    )
    vi = verb.on({"count": rig.slow, "r": rig.fast}).asynch(slow, y, n)
    rig.cell.advance("40 ms")
    with pytest.raises(gpac.SchedulingError):
        vi.set(every={"count": "20 ms"})
    vi.set(every={"count": "20 ms", "r": "2 ms"})
    rig.cell.advance("160 ms")
    assert [time for _, time in rows(slow)] == [10, 20, 30, 40, 60, 80, 100, 120, 140, 160, 180, 200]
    assert y.history[:]["value"].tolist() == [max(0.0, j // 10 - 1) for j in range(120)], "by number: no phase has slipped"


def test_r054_what_is_driven_follows_and_its_partners_are_checked(rig: Rig) -> None:
    a, b, c, n = rig.svvs("a", "b", "c", "n", history=100)
    k = rig.cell.svv("k", "int64_t")
    writer = counting(rig, "slowly", "10 ms").on(rig.slow).asynch(a)
    copying = gpac.Verb(
        "copying",
        blocks={"copy": rig.block("copy.copy")},
        instantiation_parameters={"u": "copy.u", "y": "copy.y", "n": "copy.n"},
        command_lists={"start": [activate("copy")]},
    )
    copying.on(rig.slow).asynch(a, b, k)
    ratio_verb(rig).on(rig.fast).new_instance(b, c, n)
    with pytest.raises(gpac.SchedulingError, match=r"'reading#1' follows it.*'copying#1.copy.y' updates every 20 ms"):
        writer.set(every={"count": "20 ms"})


def test_r054_only_what_is_declared_tunable(rig: Rig) -> None:
    (y,) = rig.svvs("y")
    fixed = rig.counting("fixed").on(rig.fast).asynch(y)
    with pytest.raises(gpac.InvalidState, match="the interval of 'count' in verb 'fixed' is not tunable; declare it"):
        fixed.set(every={"count": "2 ms"})
    fixed.halt()
    vi = counting(rig).on(rig.fast).asynch(y)
    with pytest.raises(gpac.UnknownName, match=r"every= names 'cuont'.*did you mean 'count'"):
        vi.set(every={"cuont": "2 ms"})
    with pytest.raises(gpac.SchedulingError, match=r"1\.5 ms"):
        vi.set(every={"count": "1.5 ms"})
    with pytest.raises(gpac.SchedulingError, match="interval of 0"):
        vi.set(every={"count": 0})
    with pytest.raises(gpac.InvalidState, match="not tunable"):
        vi.set(every={"count": "2 ms"}, limit=5)
    rig.cell.advance("8 ms")
    assert vi.state == "running" and y.value == 1
    vi.halt()
    with pytest.raises(gpac.InvalidState, match="ended"):
        vi.set(every={"count": "2 ms"})


def test_r054_tunable_parameters_change_together_in_every_source(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    names = ("torn1", "seen1", "torn2", "seen2")
    torn1, seen1, torn2, seen2 = rig.svvs(*names)
    check = rig.block("pair.pair_check")
    verb = gpac.Verb(
        "checking",
        blocks={"p": check, "q": check},
        instantiation_parameters={"torn1": "p.torn", "seen1": "p.seen", "torn2": "q.torn", "seen2": "q.seen"},
        input_parameters={
            "a": gpac.input(["p.a", "q.a"], tunable=True, default=0.0),
            "b": gpac.input(["p.b", "q.b"], tunable=True, default=0.0),
        },
        command_lists={"start": [activate("p", every=interval("1 ms", tunable=True)), activate("q", every="1 ms")]},
    )
    vi = verb.on({"p": rig.fast, "q": other}).asynch(torn1, seen1, torn2, seen2)
    for k in range(1, 50):
        vi.set(a=float(k), b=-float(k), every={"p": f"{1 + k % 3} ms"})
        rig.cell.advance("5 ms")
        assert (seen1.value, seen2.value) == (k, k)
    assert (torn1.value, torn2.value) == (0, 0)


def test_r054_a_history_keeps_its_values_at_a_slower_rate(rig: Rig) -> None:
    y = rig.cell.svv("y", history=20)
    vi = rig.counting("quick", command_lists={"start": [activate("count", every=interval("1 ms", tunable=True))]}).on(rig.fast).asynch(y)
    rig.cell.advance("50 ms")
    vi.set(every={"count": "100 ms"})
    rig.cell.advance("3 s")
    last = y.history[:]
    assert len(last) == 20
    np.testing.assert_allclose(np.diff(last["time"]), 0.1, atol=1e-9)
