# SPDX-License-Identifier: Apache-2.0
"""A verb that was told to end begins no further work: chains, parallel parts and recovery branches, and random compositions of them.

The random compositions rotate with the day; a failure names its seed, and `OPENGPAC_COMPOSITIONS_FROM=seed OPENGPAC_COMPOSITIONS=1` runs
that one again.
"""

from __future__ import annotations

import datetime
import os
import random
from collections.abc import Sequence
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, deactivate, on, wait
from rig import Rig

LEAVES = 6
Leaf = gpac.Verb[..., Any]


def leaf(rig: Rig, number: int, *, brakes: bool = True, loops: bool = False, enough: int = 4) -> Leaf:
    """Counts into `y…` until it comes to `enough`; one that brakes counts into `b…` for 3 ms after a halt or a time limit."""
    lists = {"start": [activate("count", every="1 ms")], "again": [activate("count", every="1 ms"), wait("2 ms")]}
    blocks = {"count": rig.block("count.count")}
    conditions = {"enough": on("count.enough", returns=[])}
    transitions: dict[tuple[str, str], str] = {}
    arguments, inputs = {f"y{number}": ["count.y"]}, {f"limit{number}": gpac.input("count.enough", default=enough)}
    if brakes:
        blocks["brake"] = rig.block("count.count")
        arguments[f"b{number}"] = ["brake.y"]
        inputs[f"way{number}"] = gpac.input("brake.enough", default=3)
        lists["stop"] = [activate("brake", every="1 ms")]
        conditions["stopped"] = on("brake.enough", returns=[], during="stop")
        for begins in ("start", "again", "stop"):
            transitions |= {(begins, "halted"): "stop", (begins, "time_limit"): "stop"}
    if loops:
        lists["start"] += [wait("2 ms"), deactivate("count")]
        lists["again"] += [deactivate("count")]
        transitions |= {("start", "completed"): "again", ("again", "completed"): "start"}
    else:
        del lists["again"]
        transitions = {key: to for key, to in transitions.items() if key[0] != "again"}
    return gpac.Verb(
        f"leaf{number}", blocks=blocks, instantiation_parameters=arguments, input_parameters=inputs, command_lists=lists,
        conditions=conditions, transitions=transitions, initial="start",
    )  # fmt: skip


def of_svvs(rig: Rig, count: int = LEAVES) -> dict[str, gpac.SVV[Any]]:
    return {name: rig.cell.svv(name) for number in range(count) for name in (f"y{number}", f"b{number}")}


def arguments_of(verb: Leaf, svvs: dict[str, gpac.SVV[Any]]) -> list[gpac.SVV[Any]]:
    return [svvs[name] for name in verb.instantiation_parameters]


def work(svvs: dict[str, gpac.SVV[Any]], allowed: frozenset[int] = frozenset()) -> dict[str, float]:
    """What the parts have counted that are no declared recovery."""
    return {name: svv.value for name, svv in svvs.items() if name[0] == "y" and int(name[1:]) not in allowed}


def chain(rig: Rig, count: int = 3) -> Leaf:
    verb = leaf(rig, 0, enough=50)
    for number in range(1, count):
        verb = verb >> leaf(rig, number)
    return gpac.compose("chain", verb).on(rig.fast)


def test_a_halt_ends_a_chain_and_begins_none_of_its_parts(rig: Rig) -> None:
    svvs = of_svvs(rig, 3)
    verb = chain(rig)
    vi = verb.asynch(*arguments_of(verb, svvs))
    rig.cell.advance("5.5 ms")
    counted = work(svvs)
    vi.halt()
    report = vi.wait()
    assert (report.condition, report.command_list) == ("halted", "leaf0.stop")
    assert work(svvs) == counted and svvs["b0"].value == 3


def test_a_time_limit_ends_a_chain_and_is_what_the_end_says(rig: Rig) -> None:
    svvs = of_svvs(rig, 3)
    verb = chain(rig)
    with pytest.raises(gpac.Terminated) as ended:
        verb(*arguments_of(verb, svvs), time_limit="5.5 ms")
    assert (ended.value.condition, ended.value.command_list) == ("time_limit", "leaf0.stop")
    assert svvs["y0"].value == 4 and svvs["y1"].value == svvs["y2"].value == 0


def test_parts_that_run_together_until_all_lead_on_to_nothing_after_a_halt(rig: Rig) -> None:
    svvs = of_svvs(rig, 3)
    both = gpac.together(leaf(rig, 0, enough=50), leaf(rig, 1, enough=60), name="both", until="all")
    verb = gpac.compose("then_one", both >> leaf(rig, 2)).on(rig.fast)
    vi = verb.asynch(*arguments_of(verb, svvs))
    rig.cell.advance("5.5 ms")
    vi.halt()
    assert vi.wait().condition == "halted" and svvs["y2"].value == 0 and svvs["b0"].value == svvs["b1"].value == 3
    with pytest.raises(gpac.Terminated) as ended:
        verb(*arguments_of(verb, svvs), time_limit="5.5 ms")
    assert ended.value.condition == "time_limit"


def test_a_part_that_a_halt_leads_to_is_the_last_one_also_where_it_is_one_of_a_chain(rig: Rig) -> None:
    svvs = of_svvs(rig, 3)
    parts = {"a": leaf(rig, 0, brakes=False, enough=50), "park": leaf(rig, 1), "b": leaf(rig, 2)}
    steps = {("a", None): "park", ("park", None): "b", ("a", "halted"): "park"}
    verb = gpac.compose("parking", parts, transitions=steps).on(rig.fast)
    vi = verb.asynch(*arguments_of(verb, svvs))
    rig.cell.advance("5.5 ms")
    vi.halt()
    report = vi.wait()
    assert (report.condition, report.command_list) == ("halted", "park.start")
    assert (svvs["y1"].value, svvs["y2"].value) == (4, 0)
    assert verb(*arguments_of(verb, svvs), limit0=5).command_list == "b.start", "what nothing has told to end goes on"


def test_an_ending_that_is_declared_by_its_condition_begins(rig: Rig) -> None:
    svvs = of_svvs(rig, 3)
    parts = {"a": leaf(rig, 0, enough=50), "park": leaf(rig, 1), "after": leaf(rig, 2)}
    steps = {("a.stop", "stopped"): "park", ("park", None): "after"}
    verb = gpac.compose("parked", parts, transitions=steps).on(rig.fast)
    vi = verb.asynch(*arguments_of(verb, svvs))
    rig.cell.advance("5.5 ms")
    vi.halt()
    vi.wait()
    assert (svvs["y1"].value, svvs["y2"].value) == (4, 4)


def test_a_chain_that_is_aborted_begins_none_of_its_parts(rig: Rig) -> None:
    class Slide(gpac.LogicalDevice, name="Slide that gives way", arbitration="abort"):
        y = gpac.svv()

    slide = Slide("slide", system=rig.cell).enable()
    after = rig.cell.svv("after")
    one = rig.counting(
        "one", objects={"slide": Slide}, instantiation_parameters={"slide.y": ["count.y", "brake.y"]},
        blocks={"count": rig.block("count.count"), "brake": rig.block("count.count")},
        input_parameters={"limit": gpac.input("count.enough", default=50), "way": gpac.input("brake.enough", default=3)},
        command_lists={"start": [activate("count", every="1 ms")], "stop": [activate("brake", every="1 ms")]}, initial="start",
        conditions={"enough": on("count.enough", returns=[]), "stopped": on("brake.enough", returns=[], during="stop")},
        transitions={("start", "halted"): "stop", ("stop", "halted"): "stop"},
    )  # fmt: skip
    two = rig.counting(
        "two", instantiation_parameters={"after": "count.y"}, input_parameters={"most": gpac.input("count.enough", default=50)}
    )
    chain = gpac.compose("chain", one >> two).on(rig.fast)
    vi = chain.asynch(slide, after)
    rig.cell.advance("5.5 ms")
    late = rig.counting("late").on(rig.fast).asynch(slide.y, limit=2, time_limit="20 ms")
    rig.cell.advance("12 ms")
    with pytest.raises(gpac.Terminated, match="aborted"):
        vi.wait()
    assert late.wait().last == 2 and after.value == 0


def test_parts_that_run_until_all_have_ended_end_what_runs_beside_them(rig: Rig) -> None:
    svvs = of_svvs(rig, 3)
    both = gpac.together(leaf(rig, 0, enough=5), leaf(rig, 1, enough=9), name="both", until="all")
    watch = leaf(rig, 2, brakes=False, enough=1000)
    verb = gpac.together(both, watch, name="guarded").on(rig.fast)
    report = verb(*arguments_of(verb, svvs), time_limit="1 s")
    assert report.condition == "completed" and 8 <= svvs["y2"].value <= 11


# ---- random compositions ----


class Drawn:
    """A random composition, and the leaves that it declares as what a halt or a time limit leads to."""

    def __init__(self, rig: Rig, rng: random.Random) -> None:
        self.rig, self.rng = rig, rng
        self.free = list(range(LEAVES))
        rng.shuffle(self.free)
        self.recovery: set[int] = set()
        self.count = 0
        self.verb = self.draw(3).on(rig.fast)

    def leaf(self) -> Leaf:
        rng = self.rng
        return leaf(self.rig, self.free.pop(), brakes=rng.random() < 0.7, loops=rng.random() < 0.2, enough=rng.randint(2, 12))

    def name(self) -> str:
        self.count += 1
        return f"drawn{self.count}"

    def draw(self, depth: int) -> Leaf:
        rng = self.rng
        kind = rng.choice(["leaf", "chain", "chain", "loop", "together", "recovery"]) if depth and len(self.free) > 2 else "leaf"
        if kind == "leaf":
            return self.leaf()
        first = self.draw(depth - 1)
        if not self.free:
            return first
        if kind == "recovery":
            number = self.free[-1]
            after = leaf(self.rig, self.free.pop(), brakes=rng.random() < 0.5, enough=rng.randint(2, 6))
            if first.conditions.keys() and not any(condition == "halted" for _, condition in first.transitions):
                self.recovery.add(number)
                return gpac.compose(self.name(), {"a": first, "r": after}, transitions={("a", None): "r", ("a", "halted"): "r"})
            return gpac.compose(self.name(), {"a": first, "r": after}, transitions={("a", None): "r"})
        second = self.draw(depth - 1)
        parts = {"a": first, "b": second}
        if kind == "together":
            return gpac.together(parts, name=self.name(), until=rng.choice(["any", "all"]))
        back = {("b", None): "a"} if kind == "loop" else {}
        return gpac.compose(self.name(), parts, transitions={("a", None): "b", **back})


ENDS = ("halt", "time_limit", "suspended", "paused", "emergency_stop", "halted twice")
"""Ways to tell an instance to end; of each composition four are tried, at random instants."""


def tell(rig: Rig, vi: gpac.VerbInstance[Any], how: str) -> None:
    """Tells an instance to end; a time limit has been given at its start."""
    if how == "suspended":
        vi.suspend()
    elif how == "paused":
        rig.cell.pause()
    if how == "emergency_stop":
        rig.cell.emergency_stop("a test")
    elif how != "time_limit":
        vi.halt()
    if how == "halted twice" and not vi.done:
        vi.halt()
    if how == "paused":
        rig.cell.resume()


def try_ends(rig: Rig, svvs: dict[str, gpac.SVV[Any]], seed: int, ends: Sequence[str] = ()) -> bool:
    """Draws a composition and ends it at four random instants; false for one that the model refuses."""
    rng = random.Random(seed)
    try:
        drawn = Drawn(rig, rng)
        vi = drawn.verb.new_instance(*arguments_of(drawn.verb, svvs))
    except gpac.Error:
        return False
    for how in ends or rng.sample(ENDS, 4):
        at = rng.randint(0, 25) + 0.5
        vi.start(**({"time_limit": f"{at} ms"} if how == "time_limit" else {}))
        rig.cell.advance(f"{at} ms")
        if vi.done:
            continue
        # An emergency stop leads to nothing, also not to what is declared for a halt.
        endings = frozenset[int]() if how == "emergency_stop" else frozenset(drawn.recovery)
        counted = work(svvs, endings)
        tell(rig, vi, how)
        rig.cell.advance("40 ms")
        where = f"seed {seed}, {how} at {at} ms: {drawn.verb!r}"
        assert vi.report is not None, where
        assert vi.report.condition in ("halted", "time_limit", "stopped", "completed", "emergency_stop"), where
        assert (vi.report.condition == "emergency_stop") == (how == "emergency_stop"), where
        assert work(svvs, endings) == counted, where
        if how == "emergency_stop":
            rig.cell.reset()
            rig.cell.advance("5 ms")
            assert work(svvs, endings) == counted, where
    vi.delete()
    return True


def test_nothing_begins_in_any_composition_that_was_told_to_end(rig: Rig) -> None:
    count = int(os.environ.get("OPENGPAC_COMPOSITIONS", "250"))
    first = int(os.environ.get("OPENGPAC_COMPOSITIONS_FROM", datetime.date.today().toordinal() * 100_000))
    svvs = of_svvs(rig)
    tried = sum(try_ends(rig, svvs, seed) for seed in range(first, first + count))
    assert count == 1 or tried > count / 3, f"the model refused {count - tried} of {count} compositions"


def test_parts_that_go_on_together_where_a_halt_leads_one_of_them_are_refused(rig: Rig) -> None:
    """Their next lists are one: at a halt of the recovery the work of the other part would begin with it."""
    chain = gpac.compose("chain", leaf(rig, 0, brakes=False) >> leaf(rig, 1, brakes=False))
    parts = {"a": leaf(rig, 2, brakes=False), "r": leaf(rig, 3, brakes=False)}
    recovery = gpac.compose("recovery", parts, transitions={("a", None): "r", ("a", "halted"): "r"})
    with pytest.raises(gpac.CompositionConflict, match="a halt leads to the first alone: the second would begin then"):
        gpac.together({"x": chain, "y": recovery}, name="both").on(rig.fast)


@pytest.mark.parametrize("seed", [910000130, 910000703, 910001577, 910005618])
def test_what_follows_a_part_without_a_normal_end_of_its_own_begins_at_no_halt(rig: Rig, seed: int) -> None:
    """The one way to a normal end is a list that the halt leads to: here the next part is no work, and was taken for an ending."""
    assert try_ends(rig, of_svvs(rig), seed, ("halt", "time_limit", "suspended", "halt"))
