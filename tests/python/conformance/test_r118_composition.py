# SPDX-License-Identifier: Apache-2.0
"""Requirements 118, 119, 123 and 124: verbs composed of verbs, and the levels of control."""

from __future__ import annotations

import runpy
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, on, wait
from rig import Rig

ROOT = Path(__file__).parents[3]


class Slipped(gpac.Terminated):
    """Raised if a part slipped."""


def counting(rig: Rig, name: str, out: str, **changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb that counts into an SVV of its own name, and ends with `enough` at its limit."""
    return rig.counting(name, **{"instantiation_parameters": {out: "count.y"}, **changes})


def pair(rig: Rig, **options: Any) -> gpac.ComposedVerb:
    """Returns a verb in which `first` counts into a and, after `enough`, `second` counts into b."""
    parts = {"first": counting(rig, "first", "a"), "second": counting(rig, "second", "b")}
    return gpac.compose("pair", parts, **{"transitions": {("first", "enough"): "second"}, **options})


def test_r118_the_transition_leads_from_part_to_part(rig: Rig) -> None:
    a, b = rig.svvs("a", "b", history=20)
    report = pair(rig).on(rig.fast)(a, b, limit=4)
    assert (report.condition, report.last, report.command_list) == ("enough", 4, "second.start")
    assert a.history[:]["value"].tolist() == b.history[:]["value"].tolist() == [0, 1, 2, 3, 4]
    # The second part's first invocation is in the next firing: no other party was asked. In real time its release may be skipped.
    assert b.history[:]["time"][0] - a.history[:]["time"][-1] == pytest.approx(0.001) or not rig.cell.virtual


def test_r118_a_composed_verb_is_a_verb(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = pair(rig)
    assert isinstance(verb, gpac.Verb) and [*verb.signature.parameters] == ["a", "b", "limit"]
    vi = verb.on(rig.fast).new_instance(a, b)
    assert [vi.start(limit=n).wait().last for n in (2, 5)] == [2, 5]
    vi.delete()
    assert verb.on(rig.fast).asynch(a, b, limit=3).wait().last == 3
    assert [*verb.parts] == ["first", "second"] and verb.parts["first"].simple and not verb.simple


def test_r118_its_table_shows_what_happens(rig: Rig) -> None:
    assert pair(rig).table() == [
        ("first.start", "enough", "→ second.start"),
        ("second.start", "enough", "ends, returns last"),
    ]
    assert "composed verb pair(a, b, limit=0)" in repr(pair(rig)) and "of first, second" in repr(pair(rig))


def test_r118_the_result_composes_again(rig: Rig) -> None:
    a, b, c = rig.svvs("a", "b", "c")
    third = counting(rig, "third", "c")
    both = gpac.compose("both", {"pair": pair(rig), "third": third}, transitions={("pair", "enough"): "third"})
    assert both.on(rig.fast)(a, b, c, limit=3).command_list == "third.start"
    assert (a.value, b.value, c.value) == (3, 3, 3)
    assert [row[:2] for row in both.table()] == [(name, "enough") for name in ("pair.first.start", "pair.second.start", "third.start")]


def test_r118_a_line_may_lead_from_a_part_of_a_part(rig: Rig) -> None:
    a, b, c = rig.svvs("a", "b", "c")
    third = counting(rig, "third", "c")
    lines = {("pair.second", "enough"): "third", ("third", "enough"): "pair.second"}
    both = gpac.compose("both", {"pair": pair(rig), "third": third}, transitions=lines)
    vi = both.on(rig.fast).asynch(a, b, c, limit=3)
    rig.cell.advance("30 ms")
    assert vi.state == "running" and rig.cell.instances[-1].command_list in ("pair.second.start", "third.start")
    vi.halt()


def test_r118_a_cycle_of_tau_runs_on_the_real_time_system(rig: Rig) -> None:
    a, b = rig.svvs("a", "b", history=64)
    lines = {("first", "enough"): "second", ("second", "enough"): "first"}
    vi = pair(rig, transitions=lines, preset={"first.limit": 2, "second.limit": 3}).on(rig.fast).asynch(a, b)
    rig.cell.advance("25 ms")
    lists = [entry["text"] for entry in rig.cell.log() if entry["kind"] == "transition"]
    assert {"command list 'second.start' after 'first.start'", "command list 'first.start' after 'second.start'"} == set(lists)
    assert len(lists) > 10
    assert len(a.history[:]) > 5 and len(b.history[:]) > 5
    vi.halt()
    assert vi.report is not None and vi.report.condition == "halted"


def test_r118_a_preset_fixes_the_input_of_one_part(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = pair(rig, preset={"first.limit": 7})
    assert [*verb.signature.parameters] == ["a", "b", "limit"]
    verb.on(rig.fast)(a, b, limit=2)
    assert (a.value, b.value) == (7, 2)
    with pytest.raises(gpac.CallError, match=r"first\.limit"):
        verb.on(rig.fast)(a, b, **{"first.limit": 3})


def test_r118_renamed_things_stay_apart(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    rename = {"second.limit": "then_limit", "second.enough": "full", "second.last": "then_last"}
    verb = pair(rig, rename=rename)
    report = verb.on(rig.fast)(a, b, limit=3, then_limit=6)
    assert (report.condition, report.outputs, a.value) == ("full", {"last": 3, "then_last": 6}, 3)


def test_r118_what_a_part_that_did_not_end_says_is_absent(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    second = counting(
        rig, "second", "b", output_values={"b_last": "count.y"}, conditions={"enough": on("count.enough", returns=["b_last"])}
    )
    first = counting(rig, "first", "a")
    verb = gpac.compose("pair", [first, second], transitions={("first", "completed"): "second"})
    report = verb.on(rig.fast)(a, b, limit=2)
    assert report.outputs == {"last": 2}, "the first part ended the verb: the second says nothing"
    assert (first >> second).on(rig.fast)(a, b, limit=2).outputs == {"last": 2, "b_last": 2}


def test_r118_one_condition_stands_for_another_block_in_each_part(rig: Rig) -> None:
    """A shared block reports the end of one part only: in the other part its report is not a condition."""
    a, b, t = rig.svvs("a", "b", "t")

    def part(name: str, out: str, of: str, **more: Any) -> gpac.Verb[..., Any]:
        return gpac.Verb(
            name,
            blocks={"clock": rig.block("count.count"), "count": rig.block("count.count")},
            instantiation_parameters={"t": "clock.y", out: "count.y"},
            input_parameters={"early": "clock.enough", "limit": "count.enough"},
            command_lists={"start": [activate("clock", every="1 ms"), activate("count", every="1 ms")]},
            conditions={"enough": on(f"{of}.enough", returns=[])},
            **more,
        )

    first, second = part("first", "a", "clock"), part("second", "b", "count")
    verb = gpac.compose("pair", [first, second], transitions={("first", "enough"): "second"}, share=["clock"])
    report = verb.on(rig.fast)(t=t, a=a, b=b, early=3, limit=9)
    assert report.block == "second.count" and report.command_list == "second.start"
    assert (a.value, b.value) == (3, 9)


def test_r118_a_shared_block_runs_on_across_the_transition(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    t = rig.cell.svv("t", history=64)

    def part(name: str, out: str) -> gpac.Verb[..., Any]:
        return gpac.Verb(
            name,
            blocks={"clock": rig.block("count.count"), "count": rig.block("count.count")},
            instantiation_parameters={"t": "clock.y", out: "count.y"},
            input_parameters={"limit": "count.enough"},
            command_lists={"start": [activate("clock", every="1 ms"), activate("count", every="1 ms")]},
            conditions={"enough": on("count.enough", returns=[])},
        )

    verb = gpac.compose("pair", [part("first", "a"), part("second", "b")], transitions={("first", "enough"): "second"}, share=["clock"])
    verb.on(rig.fast)(t=t, a=a, b=b, limit=5)
    times = t.history[:]["time"]
    assert t.history[:]["value"].tolist() == [*range(12)], "it has one instance: no number is lost or begins again"
    assert max(y - x for x, y in pairwise(times)) == pytest.approx(0.001) or not rig.cell.virtual


def test_r118_together_runs_both_and_returns_what_both_say(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    first = counting(rig, "first", "a")
    second = counting(rig, "second", "b", input_parameters={"other": "count.enough"}, output_values={"b_last": "count.y"},
                      conditions={"enough": on("count.enough", returns=["b_last"])})  # fmt: skip
    both = gpac.together(first, second)
    assert both.simple and [*both.command_lists] == ["start"], "one command list: by the paper's word it is simple"
    report = both.on(rig.fast)(a, b, limit=4, other=50)
    assert report.outputs == {"last": 4, "b_last": 4}


def test_r118_suspended_in_the_middle_it_goes_on_where_it_was(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    vi = pair(rig).on(rig.fast).asynch(a, b, limit=6)
    rig.cell.advance("10 ms")
    vi.suspend()
    assert (vi.state, a.value) == ("suspended", 6)
    held = b.value
    rig.cell.advance("50 ms")
    assert b.value == held and 0 < held < 6
    vi.resume()
    report = vi.wait()
    assert (report.last, report.command_list) == (6, "second.start")


def test_r118_each_start_begins_with_the_first_part(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    vi = pair(rig).on(rig.fast).new_instance(a, b)
    vi.start(limit=50)
    rig.cell.advance("60 ms")
    vi.halt()
    assert vi.start(limit=3).wait().command_list == "second.start"
    assert (a.value, b.value) == (3, 3)


def test_r118_during_stays_within_its_part(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    first = rig.counting(
        "first",
        instantiation_parameters={"a": "count.y"},
        command_lists={"one": [activate("count", every="1 ms"), wait("5 ms")], "two": [activate("count", every="2 ms")]},
        initial="one",
        conditions={"early": on("count.enough", returns=[], during="two"), "enough": on("count.enough", during="one")},
        transitions={("one", "enough"): "two"},
    )
    verb = gpac.compose("pair", {"x": first, "y": counting(rig, "y", "b")}, transitions={("x", "early"): "y"})
    assert [row for row in verb.table() if row[0].startswith("x.")] == [
        ("x.one", "enough", "→ x.two"), ("x.two", "early", "→ y.start"),
    ]  # fmt: skip
    assert verb.on(rig.fast)(a, b, limit=3).command_list == "y.start"


def test_r118_each_part_raises_its_own_exceptions(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    second = counting(rig, "second", "b", conditions={"enough": on("count.enough", raises=Slipped)})
    verb = counting(rig, "first", "a").then("enough", second)
    with pytest.raises(Slipped) as caught:
        verb.on(rig.fast)(a, b, limit=2)
    assert (caught.value.condition, caught.value.command_list, caught.value.block) == ("enough", "second.start", "second.count")


def test_r118_a_chain_goes_on_at_every_normal_end(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    first, second = counting(rig, "first", "a"), counting(rig, "second", "b")
    chain = first >> second >> first
    assert [*chain.parts] == ["first", "second", "first_2"]
    named = gpac.compose("thrice", chain, preset={"first_2.limit": 9})
    assert named.name == "thrice" and named.on(rig.fast)(a, b, limit=3).last == 9
    assert named.then("enough", second).parts["thrice"] is named, "what has a name is one part"


def test_r118_a_system_condition_leads_on_too(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = pair(rig, transitions={("first", "time_limit"): "second", ("first", "halted"): "second"})
    report = verb.on(rig.fast)(a, b, limit=6, time_limit="4 ms")
    assert (report.command_list, a.value, b.value) == ("second.start", 3, 6)
    vi = verb.on(rig.fast).asynch(a, b, limit=20)
    rig.cell.advance("2 ms")
    vi.halt()
    assert b.value == 20, "halted had a transition: the halt is orderly"


def test_r118_redefining_a_part_leaves_the_composed_verb_as_it_was(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = pair(rig)
    counting(rig, "second", "b", every="5 ms")
    before = rig.cell.now
    verb.on(rig.fast)(a, b, limit=10)
    assert rig.cell.now - before < 0.03 or not rig.cell.virtual


def test_r118_parts_stay_where_they_were_placed(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    first, second = counting(rig, "first", "a").on(rig.slow, every={"count": "10 ms"}), counting(rig, "second", "b").on(rig.fast)
    before = rig.cell.now
    assert (first >> second)(a, b, limit=3).last == 3
    spent = rig.cell.now - before
    assert spent > 0.03 and (spent < 0.05 or not rig.cell.virtual), "three cycles of 10 ms, then three of 1 ms"


def test_r118_arms_go_from_verb_to_verb() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual").enable()
    move = gpac.robots.move
    there_and_back = gpac.compose("there_and_back", [move, move], transitions={("robot_move", "arrived"): "robot_move_2"},
                                  rename={"robot_move_2.goal": "then"})  # fmt: skip
    assert [*there_and_back.signature.parameters] == ["arm", "goal", "speed", "tolerance", "then"]
    home = [float(q) for q in arm.values("sensed")]
    report = there_and_back(arm, goal=[q + 0.2 for q in home], then=home, time_limit="20 s")
    assert report.command_list == "robot_move_2.start" and report.position == pytest.approx(home, abs=0.01)
    arm.system.close()


def test_r118_conflicts_are_refused_all_at_once(rig: Rig) -> None:
    first, second = counting(rig, "first", "a"), counting(rig, "second", "a")
    with pytest.raises(gpac.InstallationErrors) as caught:
        gpac.together(first, second, name="both")
    assert [type(error) for error in caught.value.errors] == [gpac.SecondWriter, gpac.CompositionConflict]
    assert all("first" in str(error) and "second" in str(error) and error.line for error in caught.value.errors)
    with pytest.raises(gpac.CompositionConflict, match="nothing leads from"):
        gpac.compose("pair", [first, second])


def test_r119_simple_verbs_are_reported_as_simple(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = pair(rig)
    assert verb.parts["first"].simple and not verb.simple
    assert repr(verb.parts["first"]).startswith("simple verb first")
    verb.on(rig.fast)(a, b, limit=1)
    verb.parts["first"].on(rig.fast)(a, limit=1)
    listed = {entry.name: entry for entry in rig.cell.verbs}
    assert listed["first"].simple and not listed["pair"].simple
    assert listed["pair"].parts == {"first": "first", "second": "second"}
    assert "composed of first, second, 2 command lists" in repr(rig.cell.verbs)


def test_r123_verbs_that_support_devices_and_verbs_that_act_on_them(rig: Rig) -> None:
    servo = gpac.Verb(
        "keeping",
        blocks={"s": rig.block("copy.sample")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s", every="1 ms"), gpac.ready()]},
    )

    class Axis(gpac.LogicalDevice, verb=servo):
        """Axis with a servo."""

        u: gpac.SVV[float] = gpac.svv()
        y: gpac.SVV[float] = gpac.svv()

    axis = Axis("axis", on=rig.fast).enable()
    acting = gpac.Verb(
        "acting",
        blocks={"count": rig.block("count.count")},
        objects={"axis": Axis},
        instantiation_parameters={"axis.u": "count.y"},
        command_lists={"start": [activate("count", every="1 ms")]},
    )
    vi = acting.on(rig.fast).asynch(axis)
    assert servo.supports == ("Axis",) and acting.supports == ()
    assert "supports Axis" in repr(servo) and "supports" not in repr(acting)
    assert {entry.name: entry.kind for entry in rig.cell.verbs} == {"keeping": "supports devices", "acting": "acts on devices"}
    assert [(entry.verb, entry.device) for entry in rig.cell.instances] == [("keeping", "axis"), ("acting", None)]
    assert "acts on devices" in repr(rig.cell.instances) and "supports axis" in repr(rig.cell.instances)
    vi.halt()


def test_r124_three_levels_are_three_files(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    folder = ROOT / "examples" / "levels"
    monkeypatch.syspath_prepend(str(folder))
    report = runpy.run_path(str(folder / "program.py"))["main"]()
    for module in ("actions", "sequence"):
        sys.modules.pop(module, None)
    assert report.condition == "there" and report.reached == pytest.approx(0.11, abs=0.001)
    assert "composed verb press(slide, contact=None, depth=None)" in capsys.readouterr().out
    sequence = (folder / "sequence.py").read_text()
    assert "blocks" not in sequence and "activate" not in sequence, "who writes a sequence names verbs only"


def test_r124_a_sequence_is_changed_without_touching_the_verbs(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    first, second = counting(rig, "first", "a"), counting(rig, "second", "b")
    assert (first >> second).on(rig.fast)(a, b, limit=2).command_list == "second.start"
    assert (second >> first).on(rig.fast)(b, a, limit=2).command_list == "first.start"
