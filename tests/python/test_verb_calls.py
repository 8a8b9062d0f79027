# SPDX-License-Identifier: Apache-2.0
"""A call of a verb, `verb(...)`: one request, and every call is like the first, whatever is cached for the next one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, execute, input, on
from opengpac import library as lib
from rig import Rig


def test_nothing_is_left_of_a_call(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    for at in range(1, 4):
        report = counting(a, limit=3)
        assert (report.instance, report.last) == (f"counting#{at}", 3.0), "it counts from its begin, under a name of its own"
        assert memory_rig.cell.names["instances"] == []
        assert memory_rig.cell.statistics["instances"] == []
    a.delete()


def test_a_verb_that_is_redefined_between_two_calls_is_another(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    assert memory_rig.counting().on(memory_rig.fast)(a, limit=3).last == 3.0
    half = memory_rig.counting(input_parameters={"limit": input("count.enough", default=5)})
    assert half.on(memory_rig.fast)(a).last == 5.0
    assert memory_rig.counting().on(memory_rig.fast)(a, limit=3).last == 3.0


def test_a_claim_of_another_between_two_calls_is_respected(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    assert counting(a, limit=3).last == 3.0
    holder = memory_rig.counting("holding").on(memory_rig.fast).asynch(a)
    with pytest.raises(gpac.SecondWriter, match="holding#1"):
        counting(a, limit=3)
    assert memory_rig.cell.names["instances"] == ["holding#1"]
    holder.halt()
    holder.wait()
    assert counting(a, limit=3).instance == "counting#3", "the one that was refused has had its number"


def test_calls_go_on_after_an_emergency_stop_and_a_reset(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    assert counting(a, limit=3).last == 3.0
    memory_rig.cell.emergency_stop("test")
    with pytest.raises(gpac.Error, match="test"):
        counting(a, limit=3)
    memory_rig.cell.reset()
    assert counting(a, limit=3).last == 3.0


def test_what_a_call_stood_on_can_be_deleted_and_made_anew(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    assert counting(a, limit=3).last == 3.0
    a.delete()
    again = memory_rig.cell.svv("a", history=4)
    assert counting(again, limit=3).last == 3.0
    assert [row["value"] for row in again.history[-3:]] == [1.0, 2.0, 3.0]


def test_a_rate_that_changes_between_two_calls_is_checked(memory_rig: Rig) -> None:
    a, b = memory_rig.svvs("a", "b")
    reading = gpac.Verb(
        "reading",
        blocks={"g": lib.gain},
        instantiation_parameters={"u": "g.u", "y": "g.y"},
        command_lists={"start": [activate("g")]},
    ).on(memory_rig.fast)
    with memory_rig.counting().on(memory_rig.fast).new_instance(a) as writer:
        writer.start()
        with pytest.raises(gpac.Error):
            reading(a, b, time_limit="20 ms")  # it ends by its limit: that one raises, and it ran
    with pytest.raises(gpac.Error) as refused:
        reading(a, b, time_limit="20 ms")
    assert not isinstance(refused.value, gpac.Terminated), "nobody writes it any more: the plan of before holds no longer"


def test_each_call_starts_from_the_initial_state(memory_rig: Rig) -> None:
    block = memory_rig.block("count.count")
    once = gpac.Verb(
        "once",
        blocks={"c": block},
        cells={"n": ["c.y"]},
        output_values={"n": "c.y"},
        command_lists={"start": [execute("c"), execute("c")]},
        conditions={"completed": on(returns=["n"])},
    ).on(memory_rig.fast)
    assert [once().n for _ in range(3)] == [1.0, 1.0, 1.0]


def test_a_start_that_is_refused_leaves_nothing(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    with pytest.raises(gpac.Error):
        counting(a, limit="three")
    assert memory_rig.cell.names["instances"] == []


def test_arguments_come_to_their_parameters_however_they_are_given(memory_rig: Rig) -> None:
    a, b = memory_rig.svvs("a", "b")
    counting = memory_rig.counting().on(memory_rig.fast)
    for _ in range(2):
        reports = [counting(a, 3), counting(a, limit=4), counting(y=a, limit=5), counting(limit=6, y=a), counting(b, 7)]
        assert [report.last for report in reports] == [3.0, 4.0, 5.0, 6.0, 7.0], "the second time as the first"
        assert (a.value, b.value) == (6.0, 7.0)
        for wrong in ({"limmit": 3}, {"y": a}):
            with pytest.raises(gpac.CallError, match=r"counting\(\)"):
                counting(a, 3, **wrong)


def test_a_verb_that_is_placed_or_named_otherwise_between_two_calls_is_so(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting(every="10 ms")
    fast = counting.on(memory_rig.fast)
    assert fast(a, 3).instance == "counting#1"
    assert counting.on(memory_rig.slow).named("slowly")(a, 3).instance == "slowly"
    vi = fast.on({"count": memory_rig.slow}).asynch(a)
    assert memory_rig.cell.names["instances"] == ["counting#2"]
    vi.halt()
    vi.wait()
    assert fast(a, 3).instance == "counting#3"


def test_what_is_given_again_is_looked_for_again(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    assert counting(a, 3).last == 3.0
    a.delete()
    memory_rig.cell.svv("a", unit="rad")
    with pytest.raises(gpac.UnknownName, match="was deleted, and"):
        counting(a, 3)


def _steps(call: Callable[[], Any]) -> int:
    """Returns the number of Python function calls in `call`: its cost, independent of the machine's load."""
    steps = 0

    def count(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal steps
        steps += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        call()
    finally:
        sys.setprofile(before)
    return steps


def test_a_call_is_a_few_steps_of_python(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    counting(a, limit=3)
    assert _steps(lambda: counting(a, limit=3)) < 120, "228 where everything was made in each call, 92 since"


def test_what_a_verb_acts_on_is_not_written_down_in_each_call(memory_rig: Rig) -> None:
    lamp = type("Lamp", (gpac.LogicalDevice,), {f"level_{n}": gpac.svv(unit="rad") for n in range(20)})
    verb = gpac.Verb(
        "shine",
        blocks={"c": memory_rig.block("count.count")},
        objects={"lamp": lamp},
        instantiation_parameters={"lamp.level_0": "c.y"},
        command_lists={"start": [execute("c")]},
    ).on(memory_rig.fast)
    device = lamp("lamp", system=memory_rig.cell)
    with device.enabled():
        verb(device)
        assert _steps(lambda: verb(device)) < 120, "1,818 where each of its 20 members was written down, 86 since"
