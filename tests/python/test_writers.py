# SPDX-License-Identifier: Apache-2.0
"""Cells that several blocks write, one after the other: value, number, time and history are those of the active block."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from mappings.mapping import MAPPINGS
from opengpac import activate, execute, library, on
from rig import Rig

BOTH_CLOCKS = ("virtual", "message", "threads", "processes")


@pytest.fixture(params=BOTH_CLOCKS)
def any_rig(request: pytest.FixtureRequest, built: dict[str, str]) -> Iterator[Rig]:
    """Yields a small system on either clock, in one process and in several."""
    with MAPPINGS[request.param].open("cell") as made:
        yield Rig(made, built)


def watching() -> gpac.Verb[..., Any]:
    """Returns a verb that ends when `u` exceeds 1,000, as an asynchronous reader sees it."""
    return gpac.Verb(
        "watching",
        blocks={"c": library.comparator},
        instantiation_parameters={"u": "c.u"},
        modes={"c.u": "asynchronous"},
        input_parameters={"at": gpac.input("c.reference", default=1000.0)},
        command_lists={"start": [activate("c", every="10 ms")]},
        conditions={"rose": on("c.rose", returns=[])},
    )


def stepping(**changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb that stores 7 in `y` by `a` for 50 ms, then 2,000 by `b`."""
    definition: dict[str, Any] = {
        "blocks": {
            "a": library.bias(b=7.0),
            "b": library.bias(b=2000.0),
            "clock": library.time_limit(limit=0.05),
            "end": library.time_limit(limit=0.05),
        },
        "instantiation_parameters": {"u": ["a.u", "b.u"], "y": ["a.y", "b.y"]},
        "modes": {"a.u": "asynchronous", "b.u": "asynchronous"},
        "output_values": {"last": "b.y"},
        "command_lists": {
            "one": [activate("a", every="10 ms"), activate("clock", every="10 ms")],
            "two": [activate("b", every="10 ms"), activate("end", every="10 ms")],
        },
        "initial": "one",
        "conditions": {"over": on("clock.expired"), "done": on("end.expired", returns=["last"])},
        "transitions": {("one", "over"): "two"},
    }
    return gpac.Verb("stepping", **{**definition, **changes})


def placed(rig: Rig, first: str) -> dict[str, Any]:
    a, b = {"fast": (rig.fast, rig.slow), "slow": (rig.slow, rig.fast), "one": (rig.fast, rig.fast)}[first]
    return {"a": a, "clock": a, "b": b, "end": b}


def begins_again(values: np.ndarray) -> np.ndarray:
    """Returns the indices at which the numbers restart: a new writer. The first number is 0, or more on a late machine: a skipped
    release consumes its number."""
    return np.flatnonzero(np.diff(values["number"].astype(np.int64), prepend=np.iinfo(np.int64).max) < 0)


@pytest.mark.parametrize("first", ["fast", "slow", "one"])
def test_the_second_writer_is_seen_wherever_it_is(any_rig: Rig, first: str) -> None:
    rig = any_rig
    third = rig.rtp.timer("third", period="10 ms", priority=50)
    zero, y = rig.cell.svv("zero"), rig.cell.svv("y", history=4000)
    watch = watching().on(third).asynch(y)
    vi = stepping().on(placed(rig, first)).asynch(zero, y)
    watch.wait()
    assert vi.wait().last == 2000.0, "ω is what the second writer stored"
    values = y.history[:]
    assert y.value == 2000.0 and set(values["value"]) == {7.0, 2000.0}
    assert (np.diff(values["time"]) >= 0).all(), "each value with its time"
    firsts = begins_again(values)
    assert len(firsts) == 2 and values["value"][firsts].tolist() == [7.0, 2000.0], "each value with the number that its block gave it"
    assert (y.number, y.time) == (values["number"][-1], pytest.approx(values["time"][-1]))


@pytest.mark.parametrize("first", ["fast", "slow"])
def test_a_private_cell_comes_to_its_second_writer(any_rig: Rig, first: str) -> None:
    rig = any_rig
    third = rig.rtp.timer("third", period="10 ms", priority=50)
    verb = stepping(
        blocks={**stepping_blocks(), "c": library.comparator},
        instantiation_parameters={"u": ["a.u", "b.u"]},
        cells={"y": ["a.y", "b.y", "c.u"]},
        modes={"a.u": "asynchronous", "b.u": "asynchronous", "c.u": "asynchronous"},
        input_parameters={"at": gpac.input("c.reference", default=1000.0)},
        output_values={"last": "b.y"},
        command_lists={
            "one": [activate("a", every="10 ms"), activate("clock", every="10 ms"), activate("c", every="10 ms")],
            "two": [activate("b", every="10 ms"), activate("c", every="10 ms")],
        },
        conditions={"over": on("clock.expired"), "rose": on("c.rose", returns=["last"])},
    )
    places = placed(rig, first)
    del places["end"]
    assert verb.on({**places, "c": third})(rig.cell.svv("zero"), time_limit="20 s").last == 2000.0


def stepping_blocks() -> dict[str, Any]:
    return {"a": library.bias(b=7.0), "b": library.bias(b=2000.0), "clock": library.time_limit(limit=0.05)}


def test_a_composition_whose_parts_write_on_several_timers(any_rig: Rig) -> None:
    """A guarded move: the approach on one timer, the retreat on another."""
    rig = any_rig
    y = rig.cell.svv("y", history=4000)
    approach = rig.counting("approach")
    retreat = gpac.Verb(
        "retreat",
        blocks={"back": library.bias(b=-5.0), "clock": library.time_limit(limit=0.03)},
        instantiation_parameters={"u": "back.u", "y": "back.y"},
        modes={"back.u": "asynchronous"},
        command_lists={"start": [activate("back", every="10 ms"), activate("clock", every="10 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )
    verb = approach.on(rig.fast).then("enough", retreat.on(rig.slow))
    verb(limit=20, u=rig.cell.svv("u"), y=y)
    assert y.value == -5.0
    values = y.history[:]["value"].tolist()
    begins = values.index(-5.0)
    assert begins > 20 and values[:begins] == list(range(begins)) and set(values[begins:]) == {-5.0}


def test_an_executed_writer_on_another_source_is_read_at_once(memory_rig: Rig) -> None:
    rig = memory_rig
    y, seen = rig.cell.svv("y", history=100), rig.cell.svv("seen", history=100)
    verb = gpac.Verb(
        "priming",
        blocks={"a": library.bias(b=3.0), "s": rig.block("copy.sample"), "b": library.bias(b=4.0)},
        instantiation_parameters={"u": ["a.u", "b.u"], "y": ["a.y", "b.y", "s.u"], "seen": "s.y"},
        modes={"a.u": "asynchronous", "b.u": "asynchronous"},
        command_lists={"start": [execute("b"), execute("a"), execute("s"), activate("b", every="1 ms"), activate("s", every="1 ms")]},
    )
    vi = verb.on({"a": rig.slow, "*": rig.fast}).asynch(rig.cell.svv("u"), y, seen)
    rig.cell.advance("3 ms")
    assert y.history[:]["value"].tolist()[:3] == [4.0, 3.0, 4.0]
    assert seen.history[:2]["value"].tolist() == [3.0, 4.0]
    vi.halt()


@pytest.mark.parametrize("where", ["another source", "the same source"])
def test_who_follows_goes_on_with_the_second_writer(rig: Rig, where: str) -> None:
    """A synchronous reader of another instance: on a software source, or on the source of both writers."""
    apart = where == "another source"
    other = rig.rtp.timer("other", period="1 ms", priority=70) if apart else rig.fast
    y, copy = rig.cell.svv("y", history=1000), rig.cell.svv("copy", history=1000)
    verb = gpac.Verb(
        "relay",
        blocks={"a": rig.block("count.count"), "b": rig.block("count.count")},
        instantiation_parameters={"y": ["a.y", "b.y"]},
        input_parameters={"limit": gpac.input("a.enough", default=9)},
        command_lists={"one": [activate("a", every="1 ms")], "two": [activate("b", every="1 ms")]},
        initial="one",
        conditions={"enough": on("a.enough"), "done": on("b.enough", returns=[])},
        transitions={("one", "enough"): "two"},
    )
    follower = gpac.Verb(
        "following",
        blocks={"c": rig.block("copy.copy")},
        instantiation_parameters={"u": "c.u", "y": "c.y"},
        command_lists={"start": [activate("c")]},
    )
    writer = verb.on({"a": rig.fast, "b": other}).new_instance(y)
    follower.on(rig.rtp.software("soft", priority=30) if apart else rig.fast).asynch(y, copy)
    for _ in range(2):
        writer.start()
        rig.cell.advance("40 ms")
        writer.halt()
    rig.cell.advance("5 ms")
    stored, copied = (svv.history[:]["value"].tolist() for svv in (y, copy))
    assert stored[:20] == 2 * list(range(10)) and copied[:9] == list(range(9))
    # Within one source a kernel makes the transition alone, and a follower switches when the supervisor learns of it.
    assert len(copied) >= len(stored) - 6
    assert copied[-10:] == stored[-10:]


def test_a_history_of_writers_that_come_and_go_is_as_deep_as_declared(rig: Rig) -> None:
    """The depth also holds while the source fires for others, and while the writer is suspended or has ended."""
    y, other = rig.cell.svv("y", history=10), rig.cell.svv("other", history=10)
    rig.counting("busy").on(rig.fast).asynch(other)
    counting = rig.counting()
    for _ in range(3):
        counting.on(rig.fast)(y, limit=3)
    rig.cell.advance("1 s")
    values = y.history[:]
    assert values["value"].tolist() == [2, 3, 0, 1, 2, 3, 0, 1, 2, 3]
    assert values["number"].tolist() == [2, 3, 0, 1, 2, 3, 0, 1, 2, 3]
    vi = counting.on(rig.fast).asynch(y)
    rig.cell.advance("20 ms")
    vi.suspend()
    before = y.history[:]
    rig.cell.advance("1 s")
    assert (y.history[:] == before).all() and len(before) == 10


def test_what_is_executed_at_time_zero_is_in_the_history(rig: Rig) -> None:
    u, y, still = rig.cell.svv("u"), rig.cell.svv("y", history=10), rig.cell.svv("still", initial=9.0, history=10)
    verb = gpac.Verb(
        "priming",
        blocks={"a": library.bias(b=3.0), "b": library.bias(b=4.0)},
        instantiation_parameters={"u": ["a.u", "b.u"], "y": "a.y", "still": "b.y"},
        modes={"a.u": "asynchronous", "b.u": "asynchronous"},
        command_lists={"start": [execute("a"), activate("a", every="1 ms"), activate("b", every="1 ms")]},
    )
    verb.on(rig.fast).asynch(u, y, still)
    assert [tuple(v) for v in y.history[:]] == [(0, 0.0, 3.0)]
    assert len(still.history[:]) == 0 and still.value == 9.0, "a block that has not run stamps nothing"
    rig.cell.advance("2 ms")
    assert [tuple(v) for v in y.history[:]] == [(0, 0.0, 3.0), (1, 0.001, 3.0), (2, 0.002, 3.0)]
    assert [tuple(v) for v in still.history[:]] == [(0, 0.001, 4.0), (1, 0.002, 4.0)]


def test_a_faulted_invocation_publishes_nothing_and_its_neighbours_do(rig: Rig) -> None:
    good, bad = rig.cell.svv("good", history=20), rig.cell.svv("bad", history=20)
    verb = gpac.Verb(
        "faulting",
        blocks={"bad": rig.block("faults.not_a_number")(at=3), "good": rig.block("count.count")},
        instantiation_parameters={"good": "good.y", "bad": "bad.y"},
        command_lists={"start": [activate("bad", every="1 ms"), activate("good", every="1 ms")]},
        transitions={("start", "fault"): "start"},
    )
    vi = verb.on(rig.fast).asynch(good, bad)
    rig.cell.advance("4 ms")
    assert (bad.number, bad.time, bad.value) == (2, pytest.approx(0.003), 3.0), "invocation 3 is none"
    assert (good.number, good.time, good.value) == (3, pytest.approx(0.004), 3.0)
    rig.cell.advance("2 ms")
    vi.halt()
    assert bad.history[:]["number"].tolist() == [0, 1, 2, 4, 5]
    assert bad.history[:]["value"].tolist() == [1, 2, 3, 4, 5]
    assert good.history[:]["number"].tolist() == [0, 1, 2, 3, 4, 5]
