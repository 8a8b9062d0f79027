# SPDX-License-Identifier: Apache-2.0
"""Alarms: their automatic causes, states, acknowledgement, history."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.robots import move


def guard(**conditions: Any) -> gpac.Verb[..., Any]:
    """Returns a verb that ends when its value exceeds 4."""
    return gpac.Verb(
        "guard",
        blocks={"read": gpac.library.read_channel, "watch": gpac.library.await_range},
        instantiation_parameters={"channel": "read.channel"},
        cells={"reading": ["read.y", "watch.u"]},
        input_parameters={"above": gpac.input("watch.low", default=4.0)},
        command_lists={"start": [gpac.activate("read", every="1 ms"), gpac.activate("watch")]},
        conditions=conditions,
    )


def states(cell: gpac.System) -> list[tuple[str, str, str]]:
    return [(alarm.code, alarm.source, alarm.state) for alarm in cell.alarms]


def test_a_servo_that_fails_is_active_until_it_is_enabled_again(cell: gpac.System) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    moving = move.asynch(bench.arm, goal=[0.5, 0.5])
    cell.advance("20 ms")
    bench.arm.disable()
    with pytest.raises(gpac.Terminated, match="device_disabled"):
        moving.wait()
    assert states(cell) == [], "what somebody asked for is no alarm"
    bench.arm.x.max_following_error = 0.02
    bench.arm.enable()
    bench.arm.x.commanded = 3.0
    cell.advance("60 ms")
    alarm = cell.alarms["following_error"]
    assert (alarm.source, alarm.state, alarm.severity, alarm.count) == ("arm.x", "active", "high", 1)
    assert "following_error" in alarm.text
    assert "enable" in alarm.remedy
    assert alarm.time == pytest.approx(cell.now, abs=0.061)
    assert cell.alarms.acknowledge(alarm) == 1
    assert states(cell) == [("following_error", "arm.x", "acknowledged")], "it cannot be acknowledged away"
    bench.arm.x.enable()
    assert states(cell) == []
    assert [a.state for a in cell.alarms.history] == ["over"]


def test_one_cause_is_one_alarm(cell: gpac.System) -> None:
    bench = Bench(cell)
    bench.arm.x.max_following_error = 0.02
    bench.arm.enable()
    moving = move.asynch(gpac.Group("y", bench.arm.y), goal=[2.0])
    bench.arm.x.commanded = 3.0
    cell.advance("60 ms")
    assert states(cell) == [("following_error", "arm.x", "active")]
    moving.halt()
    bench.arm.x.enable()
    cell.alarms.acknowledge()
    watching = gpac.Verb(
        "watching", blocks={"near": gpac.library.in_position}, objects={"arm": gpac.each(type(bench.arm.x))},
        instantiation_parameters={"arm.sensed": "near.sensed", "arm.goal": "near.goal"},
        command_lists={"start": [gpac.activate("near", every="20 ms")]}, modes={},
    ).asynch(bench.arm)  # fmt: skip
    bench.arm.x.goal = 3.0
    bench.arm.x.commanded = 3.0
    with pytest.raises(gpac.Terminated, match="device_lost"):
        watching.wait()
    assert states(cell) == [("following_error", "arm.x", "active")], "the verb that lost its device has no alarm of its own"


def test_a_lost_device(cell: gpac.System) -> None:
    bench = Bench(cell, fail_at="50 ms")
    bench.arm.enable()
    with pytest.raises(gpac.Terminated, match="device_lost"):
        move(bench.arm, goal=[1.0, 1.0])
    cell.advance("10 ms")
    assert states(cell) == [("device_lost", "drives", "active")]
    assert cell.alarms["device_lost"].severity == "critical"
    cell.alarms.acknowledge()
    assert states(cell) == [("device_lost", "drives", "acknowledged")]


def test_the_emergency_stop_is_one_alarm_until_the_reset(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"stop": True}), (60, {"stop": False})])
    cell.emergency_stop_input(bench.io["stop"])
    bench.arm.enable()
    with pytest.raises(gpac.Terminated, match="emergency_stop"):
        move(bench.arm, goal=[1.0, 1.0])
    assert states(cell) == [("emergency_stop", "io.stop", "active")]
    cell.advance("50 ms")
    cell.reset()
    assert states(cell) == [("emergency_stop", "io.stop", "returned")], "nobody has seen it"
    assert cell.alarms.acknowledge() == 1
    assert states(cell) == []
    over = cell.alarms.history[-1]
    assert over.time == pytest.approx(0.030)
    assert over.returned is not None
    assert over.time < over.returned <= (over.acknowledged_at or 0.0)


def test_ends_that_raise_are_counted(cell: gpac.System) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    for k in range(3):
        with pytest.raises(gpac.Terminated):
            move(bench.arm, goal=[1.0, 1.0], time_limit=f"{10 + k} ms")
    (alarm,) = cell.alarms
    assert (alarm.code, alarm.source, alarm.state, alarm.count) == ("timed_out", "robot_move", "returned", 3)
    assert "robot_move#3" in alarm.text
    assert move(bench.arm, goal=bench.arm.values("sensed")).condition == "arrived"
    assert len(cell.alarms) == 1, "a normal end raises none"


def test_a_fault_names_the_block(cell: gpac.System) -> None:
    bench = Bench(cell)
    with pytest.raises(gpac.Terminated, match="low is above high"):
        gpac.Verb("empty", blocks={"w": gpac.library.await_range}, instantiation_parameters={"u": "w.u"}, modes={"w.u": "asynchronous"},
                  input_parameters={"low": "w.low", "high": "w.high"}, command_lists={"start": [gpac.activate("w", every="1 ms")]}
                  ).on(bench.fast)(cell.svv("u"), low=2.0, high=1.0)  # fmt: skip
    alarm = cell.alarms["fault"]
    assert (alarm.source, alarm.block) == ("empty", "w")


def test_a_condition_raises_the_alarm_that_it_names(cell: gpac.System) -> None:
    bench = Bench(cell, [(20, {"pressure": 5.0})])
    verb = guard(high=gpac.on("watch.done", returns=[], alarm="E101"))
    with pytest.raises(gpac.UnknownName, match=r"condition 'high' of verb 'guard'.*E101"):
        verb.on(bench.fast)(channel=bench.io["pressure"])
    cell.alarms.define("E101", "the pressure is high", remedy="open the valve", severity="critical")
    verb.on(bench.fast)(channel=bench.io["pressure"])
    (alarm,) = cell.alarms
    assert (alarm.code, alarm.source, alarm.state, alarm.severity) == ("E101", "guard", "returned", "critical")
    assert alarm.text.startswith("the pressure is high")
    assert alarm.remedy == "open the valve"
    assert alarm.block == "watch"


def test_a_condition_that_leads_on_raises_its_alarm_too(cell: gpac.System) -> None:
    bench = Bench(cell, [(20, {"pressure": 5.0})])
    cell.alarms.define("E102", "the pressure was high")
    verb = gpac.Verb(
        "leading",
        blocks={"read": gpac.library.read_channel, "watch": gpac.library.await_range},
        instantiation_parameters={"channel": "read.channel"},
        cells={"reading": ["read.y", "watch.u"]},
        input_parameters={"above": "watch.low"},
        command_lists={"start": [gpac.activate("read", every="1 ms"), gpac.activate("watch")], "low": [gpac.wait("10 ms")]},
        initial="start",
        conditions={"high": gpac.on("watch.done", alarm="E102", during="start")},
        transitions={("start", "high"): "low"},
    )
    assert verb.on(bench.fast)(channel=bench.io["pressure"], above=4.0).condition == "completed"
    assert [(a.code, a.count) for a in cell.alarms] == [("E102", 1)]


def test_alarms_of_the_program(cell: gpac.System) -> None:
    cell.alarms.define("E7", "the magazine is empty", remedy="fill it", severity="low")
    cell.alarms.trip("E7", "feeder 2", source="feeder")
    alarm = cell.alarms["E7"]
    assert (alarm.text, alarm.state, alarm.severity) == ("the magazine is empty: feeder 2", "active", "low")
    assert alarm in cell.alarms.active
    assert cell.alarms.clear("E7") is True
    assert cell.alarms.clear("E7") is False
    assert cell.alarms["E7"].state == "returned"
    cell.alarms.trip("E7", source="feeder")
    assert (cell.alarms["E7"].state, cell.alarms["E7"].count) == ("active", 2)
    cell.alarms.acknowledge(cell.alarms["E7"].number)
    cell.alarms.clear("E7", source="feeder")
    assert len(cell.alarms) == 0
    assert [a.code for a in cell.alarms.history] == ["E7"]


def test_the_wall_clock_of_the_virtual_clock_is_its_own(cell: gpac.System) -> None:
    cell.alarms.define("E1", "one")
    cell.advance("90 s")
    cell.alarms.trip("E1")
    assert cell.alarms["E1"].wall == datetime(1970, 1, 1, 0, 1, 30, tzinfo=UTC)


def test_the_wall_clock_of_the_monotonic_clock_is_the_computers() -> None:
    with gpac.System("wall") as cell:
        cell.alarms.define("E1", "one")
        before = datetime.now(UTC)
        cell.alarms.trip("E1")
        assert before.timestamp() - 1 <= cell.alarms["E1"].wall.timestamp() <= datetime.now(UTC).timestamp() + 1


def test_the_history_is_bounded(cell: gpac.System) -> None:
    cell.alarms.define("E1", "one")
    for k in range(1010):
        cell.alarms.trip("E1", source=f"s{k}")
    assert len(cell.alarms) == 1000
    cell.alarms.clear("E1")
    cell.alarms.acknowledge()
    assert len(cell.alarms) == 0
    assert len(cell.alarms.history) == 1000
    assert cell.alarms.history[-1].source == "s1009"


def test_an_alarm_that_chatters_leaves_the_others_in_the_history(cell: gpac.System) -> None:
    cell.alarms.define("E1", "one")
    cell.alarms.define("E2", "two")

    def pass_over(code: str, source: str) -> None:
        cell.alarms.trip(code, source=source)
        cell.alarms.clear(code)
        cell.alarms.acknowledge()

    for k in range(3):
        pass_over("E2", f"rare{k}")
    for k in range(1010):
        pass_over("E1", f"s{k}")
    history = cell.alarms.history
    assert [alarm.source for alarm in history if alarm.code == "E2"] == ["rare0", "rare1", "rare2"]
    assert [alarm.source for alarm in history if alarm.code == "E1"] == [f"s{k}" for k in range(13, 1010)]


def test_the_listing_reads_well(cell: gpac.System) -> None:
    assert repr(cell.alarms) == "no alarms"
    cell.alarms.define("E1", "the gate is open", remedy="close it", severity="medium")
    cell.alarms.trip("E1", source="gate")
    line = repr(cell.alarms)
    for word in ("medium", "active", "E1", "gate: the gate is open", "close it"):
        assert word in line
    assert "the gate is open" in cell.alarms._repr_html_()


def test_wrong_words_are_refused(cell: gpac.System) -> None:
    cell.alarms.define("E101", "one")
    with pytest.raises(gpac.UnknownName, match="E101"):
        cell.alarms.trip("E102")
    with pytest.raises(gpac.UnknownName):
        cell.alarms.clear("E102")
    with pytest.raises(gpac.UnknownName):
        _ = cell.alarms["E101"]
    with pytest.raises(gpac.UnknownName):
        cell.alarms.acknowledge(99)
    with pytest.raises(gpac.CallError, match="did you mean 'high'"):
        cell.alarms.define("E1", "one", severity="hihg")
    with pytest.raises(gpac.CallError):
        cell.alarms.define("E1", 7)  # type: ignore[arg-type]
    with pytest.raises(gpac.DefinitionError):
        cell.alarms.define("E1", "")
    with pytest.raises(gpac.CallError):
        cell.alarms.acknowledge("E101")  # type: ignore[arg-type]
    with pytest.raises(gpac.CallError):
        cell.alarms.trip(101)  # type: ignore[arg-type]
    with pytest.raises(gpac.DefinitionError):
        gpac.on("a.b", alarm=101)  # type: ignore[arg-type]


def test_an_alarm_that_leaves_for_want_of_a_place_is_counted_and_told() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        cell.alarms.define("grave", "keep me", severity="critical")
        cell.alarms.define("slight", "one of many", severity="low")
        cell.alarms.trip("grave")
        for number in range(1000):
            cell.alarms.trip("slight", source=f"s{number}")
        assert len(cell.alarms) == 1000 and cell.alarms.dropped == 1
        assert cell.alarms["grave"].active, "a severe one stays"
        assert [alarm.source for alarm in cell.alarms.history] == ["s0"]
        assert [(e["about"], "is full" in e["text"]) for e in cell.log() if e["kind"] == "lost"] == [("s0", True)]
        assert "1 more were dropped before they ended" in repr(cell.alarms)


def test_a_shelved_alarm_is_out_of_the_list_until_its_time_is_over(cell: gpac.System) -> None:
    alarms = cell.alarms
    alarms.define("E1", "the fan is loud", severity="low")
    alarms.trip("E1", source="fan")
    alarms.shelve(alarms["E1"], "the fan is exchanged on Monday", "10 s")
    assert (len(alarms), [a.state for a in alarms.shelved], "E1" in alarms) == (0, ["shelved"], False)
    assert alarms.acknowledge() == 0, "what is shelved is seen by nobody"
    # It is the alarm itself that is shelved: it clears and recurs, and stays shelved.
    alarms.acknowledge(alarms.shelved[0])
    alarms.clear("E1")
    alarms.trip("E1", source="fan")
    assert (len(alarms), alarms.shelved[0].count) == (0, 2)
    cell.advance("9.9 s")
    assert len(alarms) == 0
    cell.advance("0.1 s")
    assert (alarms["E1"].state, alarms.shelved) == ("active", [])
    (shelving,) = alarms["E1"].shelvings
    assert (shelving.who, shelving.reason, shelving.ended_by) == ("program", "the fan is exchanged on Monday", "")
    assert (shelving.until - shelving.time, shelving.ended) == (10.0, shelving.until)
    said = [entry["text"] for entry in cell.log() if entry["kind"] == "alarm"]
    assert said[-1] == "E1: its shelving has expired"
    assert "E1: shelved for 10 s: the fan is exchanged on Monday" in said


def test_an_alarm_is_unshelved_and_what_is_over_by_then_goes_into_the_history(cell: gpac.System) -> None:
    alarms = cell.alarms
    alarms.define("E1", "the fan is loud")
    alarms.trip("E1")
    number = alarms["E1"].number
    alarms.shelve(number, "known", "1 h")
    alarms.shelve(number, "known, and it takes longer", "2 h")
    alarms.acknowledge(number)
    alarms.clear("E1")
    assert (alarms.shelved[0].number, alarms.history) == (number, [])
    assert (alarms.unshelve(number), len(alarms), alarms.shelved) == (True, 0, [])
    (over,) = alarms.history
    assert [(s.reason, s.ended is None, s.ended_by) for s in over.shelvings] == [
        ("known", False, "program"),
        ("known, and it takes longer", False, "program"),
    ]
    with pytest.raises(gpac.UnknownName):
        alarms.unshelve(number)


def test_what_is_about_safety_cannot_be_shelved(cell: gpac.System) -> None:
    alarms = cell.alarms
    alarms.define("E1", "the pressure is low", severity="critical")
    # A text of the user's own makes an emergency stop no less severe.
    alarms.define("emergency_stop", "somebody pressed", severity="low")
    alarms.trip("E1")
    cell.emergency_stop("test")
    for code, why in (("E1", "its severity is critical"), ("emergency_stop", "it is an emergency stop")):
        with pytest.raises(gpac.NotAllowed, match=why):
            alarms.shelve(alarms[code], "it is loud", "1 h")
        assert not alarms[code].shelvable
    alarms.define("E2", "the fan is loud")
    alarms.trip("E2")
    wrong = (("", "1 h", gpac.CallError), (" ", "1 h", gpac.CallError), ("x", "25 h", gpac.OutOfRange), ("x", 0.0, gpac.OutOfRange))
    for reason, time, error in wrong:
        with pytest.raises(error):
            alarms.shelve(alarms["E2"], reason, time)
    assert alarms["E2"].shelvable
    alarms.shelve(alarms["E2"], "known", "1 h")
    assert alarms.shelved[0].shelvable, "the time and the reason can be changed"
    alarms.define("E2", "the fan burns", severity="critical")
    alarms.trip("E2")
    assert not alarms["E2"].shelvable
    assert alarms["E2"].shelvings[-1].ended is not None, "one that comes again as critical is back in the list"
