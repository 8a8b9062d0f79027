# SPDX-License-Identifier: Apache-2.0
"""Values, histories, parameters and lives of verbs whose blocks are in separate processes."""

from __future__ import annotations

import pytest

import opengpac as gpac
from afar import Afar, children, resident_kb, until
from opengpac import activate, on

pytestmark = pytest.mark.alone


def test_a_history_is_kept_there(afar: Afar) -> None:
    y = afar.cell.svv("y", history=50)
    afar.counting().on(afar.there)(y, limit=20, time_limit="60 s")
    history = y.history[:]
    assert list(history["value"]) == list(range(21))
    assert list(history["number"]) == sorted(history["number"])
    assert (history["time"][1:] > history["time"][:-1]).all()


def test_values_of_two_processors_are_read_together(afar: Afar) -> None:
    near, far = afar.cell.svv("near"), afar.cell.svv("far")
    afar.counting().on(afar.here)(near, limit=7, time_limit="60 s")
    afar.counting().on(afar.there)(far, limit=9, time_limit="60 s")
    assert tuple(afar.cell.read(near, far)) == (7, 9)


def test_suspend_resume_and_halt(afar: Afar) -> None:
    y = afar.cell.svv("y")
    instance = afar.counting().on(afar.there).asynch(y)
    until(lambda: y.value > 3, "it counts")
    instance.suspend()
    rests = y.value
    assert instance.state == "suspended"
    afar.counting("meanwhile").on(afar.there)(afar.cell.svv("other"), limit=5, time_limit="60 s")
    assert y.value == rests, "the same source went on without it"
    instance.resume()
    until(lambda: y.value > rests, "it counts on")
    instance.halt()
    assert instance.report and instance.report.condition == "halted"
    ended = y.value
    afar.counting("meanwhile").on(afar.there)(afar.cell.svv("third"), limit=5, time_limit="60 s")
    assert y.value == ended


def test_a_transition_there_is_in_the_same_firing(afar: Afar) -> None:
    first, second = afar.cell.svv("first", history=20), afar.cell.svv("second", history=20)
    verb = gpac.Verb(
        "two_lists",
        blocks={"a": afar.block("count.count"), "b": afar.block("count.count")},
        instantiation_parameters={"first": "a.y", "second": "b.y"},
        input_parameters={"a_limit": "a.enough", "b_limit": "b.enough"},
        command_lists={"one": [activate("a", every="2 ms")], "two": [activate("b", every="2 ms")]},
        initial="one",
        conditions={"a_enough": on("a.enough"), "b_enough": on("b.enough", returns=[])},
        transitions={("one", "a_enough"): "two"},
    )
    report = verb.on(afar.there)(first, second, a_limit=5, b_limit=5, time_limit="60 s")
    assert (report.condition, report.command_list) == ("b_enough", "two")
    assert list(first.history[:]["value"]) == [0, 1, 2, 3, 4, 5], "no invocation after the condition"
    before, after = first.history[:]["time"][-1], second.history[:]["time"][0]
    periods = round((after - before) / 0.002)
    assert periods >= 1 and after - before == pytest.approx(0.002 * periods), "the next list begins in a later firing of the same source"
    overruns = afar.cell.statistics["sources"]["rtp1.fast"]["overruns"]
    assert periods == 1 or overruns > 0, "which is the next one where none was skipped"


def test_a_verb_over_three_processors(afar: Afar) -> None:
    third = afar.cell.processor("rtp2", process=True).software("soft", priority=70)
    verb = gpac.Verb(
        "over_three",
        blocks={"ramp": afar.block("mapping.ramp"), "gain": gpac.library.gain(k=2.0), "record": afar.block("mapping.record")},
        cells={"a": ["ramp.y", "gain.u"], "b": ["gain.y", "record.u"]},
        output_values={"values": "record.values"},
        command_lists={"start": [activate("record"), activate("gain"), activate("ramp", every="2 ms")]},
        conditions={"full": on("record.full", returns=["values"])},
    )
    soft = afar.rtp0.software("soft", priority=70)
    report = verb.on({"ramp": afar.there, "gain": third, "record": soft})(time_limit="60 s")
    assert [float(value) for value in report.values[:200]] == [2.0 * k for k in range(200)]


def test_memory_there_does_not_grow_with_instances(afar: Afar) -> None:
    verb, y, process = afar.counting(), afar.cell.svv("y"), afar.process()

    def make(times: int) -> int:
        for _ in range(times):
            verb.on(afar.there).new_instance(y).delete()
        return resident_kb(process)

    settled = make(200)
    assert make(800) - settled < 4_000, "kB more after 800 instances more"


def test_under_the_virtual_clock_all_is_one_thread(built: dict[str, str]) -> None:
    reports = []
    for process in (False, True):
        with gpac.System("virtual", clock="virtual") as cell:
            cell.processor("rtp0")
            source = cell.processor("rtp1", process=process).timer("fast", period="2 ms", priority=80)
            block = cell.download(built["count"], "count").count
            y = cell.svv("y", history=20)
            verb = gpac.Verb(
                "counting", blocks={"count": block}, instantiation_parameters={"y": "count.y"}, input_parameters={"limit": "count.enough"},
                command_lists={"start": [activate("count", every="2 ms")]}, conditions={"enough": on("count.enough", returns=[])},
            )  # fmt: skip
            report = verb.on(source)(y, limit=10)
            assert children("run_processor") == []
            reports.append((report.time, y.history[:].tolist()))
    assert reports[0] == reports[1]


def test_block_times_come_from_there(afar: Afar) -> None:
    y = afar.cell.svv("y")
    instance = afar.counting().on(afar.there).asynch(y)
    assert afar.cell.block_times(afar.there).rows == []
    until(lambda: afar.cell.block_times(afar.there).rows, "its times are told")
    (row,) = afar.cell.block_times(afar.there).rows
    assert row[2] == afar.there.name and int(row[-1]) > 0
    assert afar.cell.statistics["sources"][afar.here.name]["probed"] is False, "nobody looks here"
    instance.halt()
