# SPDX-License-Identifier: Apache-2.0
"""A verb that was ended begins no further work: chains, parallel parts and recovery branches, and random compositions of them.

The random compositions vary with the day; a failure names its seed, and `OPENGPAC_COMPOSITIONS_FROM=seed OPENGPAC_COMPOSITIONS=1`
runs that one again.
"""

from __future__ import annotations

import datetime
import os
from collections import Counter

import pytest

import opengpac as gpac
from drawn_compositions import ENDS, ENDS_OF_DEVICES, ENDS_OF_MACHINES, Leaf, Slides, arguments_of, drawn_trial, leaf, of_svvs, work
from opengpac import activate, on
from rig import Rig


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


def test_a_transition_in_the_firing_that_reads_the_emergency_input_is_part_of_the_way(rig: Rig) -> None:
    """The kernel makes a transition each millisecond; the supervisor hears of the input first, and takes the process from its new list."""
    svvs, slides = of_svvs(rig, 1), Slides(rig)
    verb = rig.counting(
        "alternating",
        command_lists={"one": [activate("count", every="1 ms")], "two": [activate("count", every="1 ms")]}, initial="one",
        conditions={"enough": on("count.enough")},
        transitions={("one", "enough"): "two", ("two", "enough"): "one"},
    ).on(rig.fast)  # fmt: skip
    vi = verb.asynch(svvs["y0"], limit=1)
    rig.cell.advance("3.5 ms")
    slides.press()
    report = vi.report
    assert report is not None
    assert report.condition == "emergency_stop"
    lists = [*(passed.command_list for passed in report.way), report.command_list]
    assert lists == [("one", "two")[number % 2] for number in range(len(lists))]
    assert svvs["y0"].value == len(report.way), "each invocation has led to the other list"
    assert [passed.time for passed in report.way] == sorted(passed.time for passed in report.way)


def test_an_ending_list_that_began_in_the_firing_that_reads_the_emergency_input_is_not_part_of_the_way(rig: Rig) -> None:
    """No transition leads to it: the condition that began it is one of the others."""
    svvs, slides = of_svvs(rig, 1), Slides(rig)
    verb = rig.counting(
        "releasing",
        command_lists={"start": [activate("count", every="1 ms")], "release": [gpac.wait("3 ms")]}, initial="start", ending="release",
    ).on(rig.fast)  # fmt: skip
    told = Counter[str]()
    for limit in range(2, 12):
        vi = verb.asynch(svvs["y0"], limit=limit)
        rig.cell.advance("3.5 ms")
        slides.press()
        rig.cell.advance("20 ms")
        report = vi.report
        assert report is not None and report.way == (), (limit, report, report and report.way)
        told[report.condition] += 1
        told["both"] += [other.condition for other in report.others] == ["enough"]
        rig.cell.reset()
    assert told["enough"] and told["emergency_stop"] and told["both"], told


# ---- random compositions ----


COMPOSITIONS = 130
"""Number of compositions for each mapping, each of which is ended in four ways: 1,000 ends in all."""
CLOSED = 20
"""Number of compositions whose system is closed."""


def seeds(count: int, offset: int = 0) -> range:
    """Returns `count` seeds of today; or the number set in the environment, from the seed set there."""
    first = int(os.environ.get("OPENGPAC_COMPOSITIONS_FROM", datetime.date.today().toordinal() * 100_000 + offset))
    asked = int(os.environ.get("OPENGPAC_COMPOSITIONS", "0"))
    return range(first, first + (max(1, asked * count // COMPOSITIONS) if asked else count))


def test_nothing_begins_in_any_composition_that_was_told_to_end(rig: Rig, request: pytest.FixtureRequest) -> None:
    chosen = seeds(COMPOSITIONS, 0 if "virtual" in request.node.name else 50_000)
    count = len(chosen)
    svvs, slides, tried, told = of_svvs(rig), Slides(rig), 0, Counter[str]()
    for seed in chosen:
        if trial := drawn_trial(rig, svvs, seed, slides):
            trial.try_ends()
            tried += 1
            told += trial.told
    assert count == 1 or tried > count / 3, f"the model refused {count - tried} of {count} compositions"
    # Few compositions may all have ended before one of the ways was tried.
    missing = [how for how in (*ENDS, *ENDS_OF_MACHINES, *ENDS_OF_DEVICES) if not told[how]]
    assert count < 100 or len(missing) <= (count < 1000), f"each way to end was tried: {told}"


def test_a_halt_begins_only_the_lists_of_the_parts_that_it_leads_on(rig: Rig) -> None:
    """Both parts go on together when they have counted enough, but a halt leads only the recovery on."""
    chain = gpac.compose("chain", leaf(rig, 0, brakes=False) >> leaf(rig, 1, brakes=False))
    parts = {"a": leaf(rig, 2, brakes=False), "r": leaf(rig, 3, brakes=False)}
    recovery = gpac.compose("recovery", parts, transitions={("a", None): "r", ("a", "halted"): "r"})
    svvs = of_svvs(rig)
    both = gpac.together({"x": chain, "y": recovery}, name="both").on(rig.fast)
    vi = both.new_instance(*arguments_of(both, svvs)).start()
    rig.cell.advance("2.5 ms")
    counted = work(svvs)
    vi.halt()
    rig.cell.advance("20 ms")
    assert counted["y0"] and counted["y2"] and work(svvs) == {**counted, "y3": 4}, vi.report
    assert vi.report is not None and vi.report.condition == "halted" and [passed.condition for passed in vi.report.way] == ["halted"]


def test_a_halt_that_leads_one_part_back_to_its_beginning_begins_no_other_part(rig: Rig) -> None:
    """The first part goes home at a halt; the second one ended when the first went on, and stays at its end."""
    parts = {"home": leaf(rig, 0, brakes=False, enough=3), "work": leaf(rig, 1, brakes=False, enough=90)}
    homing = gpac.compose("homing", parts, transitions={("home", None): "work", ("work", "halted"): "home"})
    both = gpac.together({"x": homing, "y": leaf(rig, 2, brakes=False, enough=500)}, name="both").on(rig.fast)
    svvs = of_svvs(rig)
    vi = both.new_instance(*arguments_of(both, svvs)).start()
    rig.cell.advance("8.5 ms")
    counted = work(svvs)
    vi.halt()
    rig.cell.advance("20 ms")
    begun = {name for name, value in work(svvs).items() if value != counted[name]}
    assert counted["y1"] and counted["y2"] and begun == {"y0"} and vi.report is not None, (counted, work(svvs))
    assert (vi.report.condition, vi.report.command_list) == ("halted", "x.home.start")


def test_a_time_limit_ends_the_work_of_one_part_while_another_brakes(rig: Rig) -> None:
    """A halt leads the first part to a recovery and lets the second one brake; the time limit then ends only the recovery."""
    parts = {"a": leaf(rig, 0, brakes=False, enough=90), "r": leaf(rig, 1, brakes=False, enough=90)}
    recovery = gpac.compose("recovery", parts, transitions={("a", None): "r", ("a", "halted"): "r"})
    both = gpac.together({"x": recovery, "y": leaf(rig, 2, enough=90)}, name="both").on(rig.fast)
    svvs = of_svvs(rig)
    vi = both.new_instance(*arguments_of(both, svvs)).start(way2=20, time_limit="5.5 ms")
    rig.cell.advance("2.5 ms")
    vi.halt()
    rig.cell.advance("3 ms")
    worked = svvs["y1"].value
    rig.cell.advance("40 ms")
    assert vi.report is not None and 0 < worked == svvs["y1"].value and svvs["b2"].value == 20, (worked, svvs["y1"].value, vi.report)
    assert [passed.condition for passed in vi.report.way] == ["halted", "time_limit"], vi.report.way


@pytest.mark.parametrize("seed", [910000130, 910000703, 910001577, 910005618])
def test_what_follows_a_part_without_a_normal_end_of_its_own_begins_at_no_halt(rig: Rig, seed: int) -> None:
    """The only path to a normal end is a list that a halt leads to: here the next part is not work, and was mistaken for an ending."""
    trial = drawn_trial(rig, of_svvs(rig), seed)
    assert trial is not None
    trial.try_ends(("halt", "time_limit", "suspended", "halt"))


@pytest.mark.parametrize("seed", [900000171, 910100136])
def test_a_part_that_a_halt_leads_on_alone_begins_no_work_of_its_own(rig: Rig, seed: int) -> None:
    """Parts run together in two lists here, each of which a halt leaves for a list of one part."""
    trial = drawn_trial(rig, of_svvs(rig), seed, Slides(rig))
    assert trial is not None
    for at_ms in range(20):
        for how in ("halt", "time_limit", "stop_while_it_halts"):
            trial.try_end(how, at_ms + 0.5)


def test_nothing_begins_in_a_composition_whose_system_is_closed(built: dict[str, str]) -> None:
    chosen, ran = seeds(CLOSED, 90_000), 0
    for seed in chosen:
        with gpac.System("cell", clock="virtual", seed=1) as cell:
            rig = Rig(cell, built)
            trial = drawn_trial(rig, of_svvs(rig), seed, Slides(rig))
            ran += trial is not None and trial.try_close()
    assert len(chosen) < CLOSED or ran > len(chosen) / 6
