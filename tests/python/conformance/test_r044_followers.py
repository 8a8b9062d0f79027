# SPDX-License-Identifier: Apache-2.0
"""Requirements 42 and 44 across instances: a follower of an SVV follows its writer, and ratio phases never slip."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate
from rig import Rig


def copying(rig: Rig, name: str = "copying") -> gpac.Verb[..., Any]:
    """Returns a verb that copies each value of `u` to `y`."""
    return gpac.Verb(
        name,
        blocks={"copy": rig.block("copy.copy")},
        instantiation_parameters={"u": "copy.u", "y": "copy.y", "n": "copy.n"},
        command_lists={"start": [activate("copy")]},
    )


def slow_reading(rig: Rig) -> gpac.Verb[..., Any]:
    """Returns a verb that takes a value updated once in ten of its invocations."""
    return gpac.Verb(
        "slow_reading",
        blocks={"r": rig.block("ratio.slow_input")},
        instantiation_parameters={"u": "r.u", "y": "r.y", "n": "r.n"},
        command_lists={"start": [activate("r", every="1 ms")]},
    )


@pytest.mark.parametrize("where", ["same source", "software source"])
def test_r044_a_reader_follows_the_next_writer(rig: Rig, where: str) -> None:
    soft = rig.cell.processor("rtp1").software("soft", priority=50)
    u, y = rig.cell.svv("u"), rig.cell.svv("y", history=1000)
    n = rig.cell.svv("n", "int64_t")
    counting = rig.counting().on(rig.fast)
    writer = counting.asynch(u)
    copying(rig).on(rig.fast if where == "same source" else soft).asynch(u, y, n)
    for k in range(3):
        writer = writer if k == 0 else counting.asynch(u)
        rig.cell.advance("20 ms")
        writer.halt()
        writer.wait()
        rig.cell.advance("5 ms")
    assert n.value == 60, "every value of every writer, once, and nothing between them"
    assert y.history[:]["value"].tolist() == 3 * list(range(20))


@pytest.mark.parametrize("where", ["same source", "software source"])
def test_r044_writers_that_take_turns_drive_one_reader(rig: Rig, where: str) -> None:
    soft = rig.cell.processor("rtp1").software("soft", priority=50)
    u, y = rig.cell.svv("u"), rig.cell.svv("y", history=1000)
    n = rig.cell.svv("n", "int64_t")
    first, second = (rig.counting(name).on(rig.fast).new_instance(u) for name in ("first", "second"))
    copying(rig).on(rig.fast if where == "same source" else soft).asynch(u, y, n)
    for k in range(6):
        writer = (first, second)[k % 2]
        writer.start()
        rig.cell.advance("10 ms")
        writer.halt()
        writer.wait()
        rig.cell.advance("1 ms")
    assert y.history[:]["value"].tolist() == 6 * list(range(10))


def test_r044_a_writer_whose_rate_its_followers_cannot_take_is_refused(rig: Rig) -> None:
    u, y, n = rig.svvs("u", "y", "n")
    slowly = rig.counting("slowly", every="10 ms").on(rig.slow)
    writer = slowly.new_instance(u)
    slow_reading(rig).on(rig.fast).new_instance(u, y, n)
    writer.delete()
    with pytest.raises(gpac.SchedulingError, match=r"'quick#1' would drive others: 'slow_reading#1' follows it: .*updates every 1 ms"):
        rig.counting("quick").on(rig.fast).new_instance(u)
    assert rig.cell.names["instances"] == ["slow_reading#1"]
    slowly.new_instance(u).start()


def test_r044_all_of_several_synchronous_inputs_from_different_sources(rig: Rig) -> None:
    other = rig.cell.processor("rtp1")
    beside, soft = other.timer("beside", period="1 ms", priority=80), other.software("soft", priority=50)
    a, b = rig.svvs("a", "b")
    y = rig.cell.svv("y", "double[2]", history=1000)
    joining = gpac.Verb(
        "joining",
        blocks={"j": rig.block("copy.join")},
        instantiation_parameters={"a": "j.a", "b": "j.b", "y": "j.y"},
        command_lists={"start": [activate("j")]},
    )
    first, second = rig.counting("first").on(rig.fast).new_instance(a), rig.counting("second").on(beside).new_instance(b)
    joining.on(soft).asynch(a, b, y)
    first.start()
    rig.cell.advance("3 ms")
    assert len(y.history) == 0, "one input alone makes nothing due"
    second.start()
    rig.cell.advance("200 ms")
    pairs = y.history[:]["value"]
    assert len(pairs) > 190 and (pairs[:, 0] == pairs[:, 1]).all() and (np.diff(pairs[:, 0]) == 1).all()


@pytest.mark.parametrize("seed", range(2))
def test_r042_ratio_phases_never_slip_whatever_starts_and_stops(rig: Rig, seed: int) -> None:
    chosen = random.Random(seed)
    slow, y, n = rig.cell.svv("slow"), rig.cell.svv("y", history=2000), rig.cell.svv("n")
    parties = [
        rig.counting("slowly", every="10 ms").on(rig.slow).new_instance(slow),
        slow_reading(rig).on(rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)).new_instance(slow, y, n),
    ]
    invocations = steady = 0
    for party in parties:
        party.start()
    while invocations < 100_000:
        ms = chosen.randint(500, 1500)
        rig.cell.advance(f"{ms} ms")
        if all(party.state == "running" for party in parties):
            values = y.history[-450:]["value"]
            invocations += ms
            assert (values[10:] == values[:-10] + 1).all(), "each value is there for ten invocations, in every phase of the run"
            steady += 1
        for party in chosen.sample(parties, chosen.randint(1, 2)):
            if party.state == "running":
                (party.suspend if chosen.random() < 0.5 else party.halt)()
                rig.cell.advance(f"{chosen.randint(1, 40)} ms")
            if party.state == "suspended":
                party.resume()
            else:
                if party.state == "ended":
                    party.wait()
                party.start()
    assert steady > 50
