# SPDX-License-Identifier: Apache-2.0
"""The path to an end in a report: the conditions passed, and the values that the parts on the path returned."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, on
from rig import Rig


class Jammed(gpac.Terminated):
    """Raised if the part jammed."""


def part(rig: Rig, name: str, out: str, output: str) -> gpac.Verb[..., Any]:
    """Returns a verb that counts into an SVV up to a limit of its own, and returns its count under a name of its own."""
    return rig.counting(
        name,
        instantiation_parameters={out: "count.y"},
        input_parameters={f"{name}_limit": gpac.input("count.enough")},
        output_values={output: "count.y"},
        conditions={"enough": on("count.enough", returns=[output])},
    )


def test_a_report_tells_the_way_and_what_the_parts_on_it_returned(rig: Rig) -> None:
    a, b, c = rig.svvs("a", "b", "c")
    chain = part(rig, "one", "a", "first") >> part(rig, "two", "b", "second") >> part(rig, "three", "c", "third")
    report = chain.on(rig.fast)(a, b, c, one_limit=3, two_limit=4, three_limit=5)
    assert [(p.command_list, p.condition) for p in report.way] == [("one.start", "enough"), ("two.start", "enough")]
    assert all(p.block in ("one.count", "two.count") for p in report.way)
    assert 0 < report.way[0].time < report.way[1].time < report.time
    assert (report.first, report.second, report.third, report.condition) == (3, 4, 5, "enough")
    assert "one.start enough → two.start enough" in str(report._table())


def test_what_was_returned_is_what_it_was_when_the_condition_led_on(rig: Rig) -> None:
    """Both parts use the same block, so its value at the end is different."""
    a = rig.svvs("a")[0]
    one = part(rig, "one", "a", "first")
    two = rig.counting(
        "two",
        instantiation_parameters={"a": "count.y"},
        input_parameters={"two_limit": gpac.input("more.enough")},
        blocks={"count": rig.block("count.count"), "more": rig.block("count.count")},
        command_lists={"start": [activate("count", every="1 ms"), activate("more", every="1 ms")]},
        conditions={"done": on("more.enough", returns=[])},
        output_values={},
    )
    both = gpac.compose("both", [one, two], transitions={("one", "enough"): "two"}, share=["count"])
    report = both.on(rig.fast)(a, one_limit=3, two_limit=6)
    assert report.first == 3 and a.value > 3 and report.condition == "done"


def test_parts_on_two_sources_return_theirs_too(rig: Rig) -> None:
    """Here no kernel can make the transition alone: the supervisor does."""
    a, b = rig.svvs("a", "b")
    chain = part(rig, "one", "a", "first") >> part(rig, "two", "b", "second").on(every={"count": "10 ms"})
    report = chain.on({"one.*": rig.fast, "two.*": rig.slow})(a, b, one_limit=3, two_limit=2)
    assert (report.first, report.second) == (3, 2)
    assert [(p.command_list, p.block) for p in report.way] == [("one.start", "one.count")]


def test_a_part_that_has_not_run_returns_nothing(rig: Rig) -> None:
    a, b, c = rig.svvs("a", "b", "c")
    parts = [part(rig, "one", "a", "first"), part(rig, "two", "b", "second"), part(rig, "three", "c", "third")]
    lines = {("one", "enough"): "three", ("one", "halted"): "two"}
    verb = gpac.compose("skips", parts, transitions=lines)
    report = verb.on(rig.fast)(a, b, c, one_limit=2, two_limit=2, three_limit=2)
    assert [*report.outputs] == ["first", "third"]


def test_a_loop_returns_the_latest_and_tells_the_last_steps(rig: Rig) -> None:
    """The verb loops until its time limit: the path has at most 64 steps."""
    a, b = rig.svvs("a", "b")
    parts = [part(rig, "one", "a", "first"), part(rig, "two", "b", "second")]
    loop = gpac.compose("loop", parts, transitions={("one", "enough"): "two", ("two", "enough"): "one"})
    vi = loop.on(rig.fast).new_instance(a, b)
    vi.start(one_limit=1, two_limit=2)
    rig.cell.advance("1 s")
    vi.halt()
    report = vi.wait()
    assert len(report.way) == 64 and report.condition == "halted"
    steps = [p.command_list for p in report.way]
    assert {*pairwise(steps)} == {("one.start", "two.start"), ("two.start", "one.start")}
    times = [p.time for p in report.way]
    assert times == sorted(times) and times[-1] > 0.9
    # The counters continue from their values: each round counts one more.
    assert report.first > 60 and abs(report.first - report.second) <= 2
    # The next start keeps nothing of it.
    vi.start(one_limit=1, two_limit=2)
    vi.halt()
    assert len(vi.wait().way) <= 1


def test_a_recovery_that_raises_is_no_success(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    push, back = part(rig, "push", "a", "pushed"), part(rig, "back", "b", "backed").raising(Jammed)
    verb = gpac.compose("insert", [push, back], transitions={("push", "enough"): "back"})
    with pytest.raises(Jammed) as jammed:
        verb.on(rig.fast)(a, b, push_limit=2, back_limit=3)
    error = jammed.value
    assert (error.condition, error.outputs["pushed"], error.outputs["backed"]) == ("enough", 2, 3)
    assert [p.command_list for p in error.report.way] == ["push.start"] and not error.report.normal
    # The verb itself is unchanged.
    assert rig.counting("count").on(rig.fast)(rig.svvs("y")[0], limit=2).normal


def test_the_message_names_what_had_led_there(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    back = rig.counting(
        "back",
        instantiation_parameters={"b": "count.y"},
        input_parameters={"back_limit": gpac.input("count.enough")},
        conditions={"away": on("count.enough", returns=[])},
        output_values={},
    )
    verb = gpac.compose("insert", [part(rig, "push", "a", "pushed"), back.raising(Jammed)], transitions={("push", "enough"): "back"})
    with pytest.raises(Jammed, match=r"ended with 'away'.*this followed 'enough' in list 'push.start'"):
        verb.on(rig.fast)(a, b, push_limit=2, back_limit=3)


def test_a_completed_end_raises_too_and_nothing_follows_it(rig: Rig) -> None:
    b = rig.svvs("b")[0]
    waits = rig.counting("waits", command_lists={"start": [activate("count", every="1 ms"), gpac.wait("3 ms"), gpac.deactivate("count")]})
    with pytest.raises(Jammed) as jammed:
        waits.raising(Jammed).on(rig.fast)(b)
    assert jammed.value.condition == "completed"
    with pytest.raises(gpac.CompositionConflict, match=r"every normal end.*changes nothing"):
        waits.raising(Jammed) >> part(rig, "after", "a", "last")


def test_what_cannot_raise_is_refused(rig: Rig) -> None:
    with pytest.raises(gpac.DefinitionError, match="raising"):
        rig.counting("count").raising(ValueError)  # pyright: ignore[reportArgumentType]
    chain = rig.counting("count") >> rig.counting("other")
    with pytest.raises(gpac.DefinitionError, match="call it on a part"):
        chain.raising(Jammed)
