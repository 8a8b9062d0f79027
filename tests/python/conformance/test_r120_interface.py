# SPDX-License-Identifier: Apache-2.0
"""Requirements 120, 121 and 125: configuration and execution interleave; the three invocation modes; the language."""

from __future__ import annotations

import pytest

import opengpac as gpac
from rig import Rig


def test_r120_definitions_interleave_with_execution(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance("5 ms")
    later = rig.counting("later")
    later.on(rig.fast).asynch(b)
    rig.cell.advance("5 ms")
    assert (a.value, b.value) == (9, 4)


def test_r120_a_verb_that_runs_is_not_redefined(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    vi = rig.counting().on(rig.fast).asynch(a)
    changed = rig.counting(every="2 ms")
    with pytest.raises(gpac.InUse, match=vi.name):
        changed.on(rig.fast).asynch(b)
    rig.counting().on(rig.fast).asynch(b).halt()
    vi.halt()
    vi.wait()
    assert changed.on(rig.fast)(a, limit=2).last == 2


def test_r120_an_equal_definition_is_nothing(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    for svv in (a, b):
        rig.counting().on(rig.fast).asynch(svv)
    rig.cell.advance("2 ms")
    assert a.value == b.value == 1


def test_r121_a_call_creates_starts_waits_and_deletes(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    before = rig.cell.names["instances"]
    assert rig.counting().on(rig.fast)(a, 5).last == 5
    assert rig.cell.names["instances"] == before


def test_r121_asynch_returns_at_once_and_wait_deletes(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).asynch(a, 200)
    assert vi.state == "running"
    assert vi.wait().last == 200
    assert vi.state == "deleted" and vi.report is not None and vi.report.last == 200
    assert vi.wait().last == 200


def test_r121_new_instance_is_started_many_times(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).new_instance(a)
    for limit in (3, 1, 7):
        vi.start(limit)
        assert vi.wait().last == limit
    assert vi.state == "ended"
    vi.delete()
    with pytest.raises(gpac.InvalidState):
        vi.delete()


def test_r121_each_start_begins_from_initial_state(rig: Rig) -> None:
    forgets, keeps = rig.svvs("forgets", "keeps")
    verb = gpac.Verb(
        "remembering",
        blocks={"m": rig.block("memory.memory")},
        instantiation_parameters={"forgets": "m.forgets", "keeps": "m.keeps"},
        command_lists={"start": [gpac.execute("m"), gpac.execute("m")]},
    )
    vi = verb.on(rig.fast).new_instance(forgets, keeps)
    for start in (1, 2, 3):
        vi.start().wait()
        assert (forgets.value, keeps.value) == (2, 2 * start)


def test_r125_calls_look_like_functions(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    counting = rig.counting().on(rig.fast)
    assert counting(a, limit=2).last == counting(y=a, limit=2).last == counting(a, 2).last


def test_r125_exceptions_are_rich(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    try:
        rig.counting().on(rig.fast)(a, time_limit="5 ms")
    except gpac.Terminated as error:
        assert isinstance(error, gpac.Error) and error.instance.startswith("counting")
        assert error.report.condition == "time_limit"
    else:
        pytest.fail("a time limit is not a normal end")
