# SPDX-License-Identifier: Apache-2.0
"""The emergency stop: inputs, latch, further causes, reset, and the refusals of calls meanwhile."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.robots import move


@pytest.fixture
def pushing() -> gpac.Verb[..., Any]:
    """Returns a verb that drives a part at 1 rad/s: the part's position shows for how long."""
    return gpac.Verb(
        "pushing",
        blocks={"set": gpac.library.set_analog, "write": gpac.library.write_channel},
        instantiation_parameters={"channel": "write.channel"},
        cells={"effort": ["set.y", "write.u"]},
        input_parameters={"effort": "set.value"},
        command_lists={"start": [gpac.activate("set", every="1 ms"), gpac.activate("write")]},
    )


def position(bench: Bench, part: gpac.Part) -> float:
    """Returns the position of a part."""
    verb = gpac.Verb("looking", blocks={"read": gpac.library.read_channel}, instantiation_parameters={"c": "read.channel", "q": "read.y"},
                     command_lists={"start": [gpac.execute("read")]})  # fmt: skip
    q = bench.cell.svv(f"position_{part.device.name}")
    verb.on(part.device.source)(c=part.position, q=q)
    return q.value


def test_outputs_are_safe_in_the_firing_that_read_the_input(cell: gpac.System, pushing: gpac.Verb[..., Any]) -> None:
    bench = Bench(cell, [(50, {"stop": True}), (60, {"stop": False})])
    far = bench.rtp1.physical_device("far_drives", gpac.drivers.loopback("x"), exchange=bench.far)
    cell.emergency_stop_input(bench.io["stop"])
    here = pushing.on(bench.fast).asynch(channel=bench.drives["x"].effort, effort=1.0)
    there = pushing.on(bench.far).asynch(channel=far["x"].effort, effort=1.0)
    cell.advance("70 ms")
    for instance in (here, there):
        with pytest.raises(gpac.Terminated, match=r"emergency_stop.*io\.stop"):
            instance.wait()
    cell.reset()
    # The effort is first written at 1 ms. At 50 ms the input is read, and 0 is written: 49 ms at 1 rad/s.
    assert position(bench, bench.drives["x"]) == pytest.approx(0.049, abs=1e-9)
    # The other processor writes 0 at once, between two firings, and at the latest in its next firing.
    assert 0.048 - 1e-9 <= position(bench, far["x"]) <= 0.050 + 1e-9


def test_every_instance_ends_with_the_reason(cell: gpac.System) -> None:
    bench = Bench(cell, [(50, {"stop": True})])
    cell.emergency_stop_input(bench.io["stop"])
    bench.arm.enable()
    with pytest.raises(gpac.Terminated, match=r"ended with 'emergency_stop'.*io\.stop") as caught:
        move(bench.arm, goal=[1.0, 1.0])
    assert caught.value.condition == "emergency_stop"
    assert caught.value.report.ended == pytest.approx(0.05)
    assert [joint.state for joint in bench.arm] == ["disabled", "disabled"]
    # After the end the present efforts are the safe value.
    before = bench.arm.values("sensed")
    cell.advance("100 ms")
    assert bench.arm.values("sensed") == before


def test_suspended_created_and_enabling_instances(cell: gpac.System) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    moving, idle = move.asynch(bench.arm, goal=[1.0, 1.0]), move.new_instance(bench.arm)
    cell.advance("40 ms")
    moving.suspend()
    never_ready = gpac.Verb(
        "never_ready", blocks={"read": gpac.library.read_digital}, instantiation_parameters={"channel": "read.channel"},
        command_lists={"start": [gpac.activate("read", every="1 ms"), gpac.wait("1 h"), gpac.ready()]},
    )  # fmt: skip

    class Slow(gpac.LogicalDevice, verb=never_ready):
        """Device that is never ready."""

    slow = Slow("slow", channel=bench.io["gate"], on=bench.fast)
    with pytest.raises(TimeoutError):
        slow.enable(timeout="5 ms")
    enabling = Slow("enabling", channel=bench.io["gate"], on=bench.fast)
    cell._native.enable("enabling")
    assert enabling.state == "enabling"
    cell.emergency_stop("the gate was opened")
    with pytest.raises(gpac.Terminated, match="the gate was opened"):
        moving.wait()
    cell.advance("2 ms")
    assert (idle.state, enabling.state) == ("created", "disabled")


def test_everything_is_refused_with_the_reason_until_the_reset(cell: gpac.System) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    instance = move.new_instance(bench.arm)
    running = move.asynch(bench.arm, goal=[1.0, 1.0])
    cell.advance("5 ms")
    running.suspend()
    cell.emergency_stop("pressed")
    cell.advance("1 ms")
    for call in (
        lambda: instance.start(goal=[0.0, 0.0]),
        lambda: bench.arm.enable(),
        lambda: bench.arm[0].enable(),
        lambda: cell.pause(),
        lambda: cell.resume(),
    ):
        with pytest.raises(gpac.EmergencyStopped, match="latched \\(pressed\\)"):
            call()
    with pytest.raises(gpac.InvalidState):
        running.resume()
    cell.reset()
    assert [joint.state for joint in bench.arm] == ["disabled", "disabled"]
    with pytest.raises(gpac.NotEnabled):
        instance.start(goal=[0.0, 0.0])
    bench.arm.enable()
    instance.start(goal=[0.2, 0.2])
    assert instance.wait().condition == "arrived"


def test_a_reset_names_every_cause_that_is_present(cell: gpac.System) -> None:
    rows = [(10, {"stop": True}), (20, {"stop2": True}), (30, {"stop": False}), (40, {"stop2": False})]
    bench = Bench(cell, rows)
    cell.emergency_stop_input(bench.io["stop"])
    cell.emergency_stop_input(bench.io["stop2"])
    cell.advance("15 ms")
    with pytest.raises(gpac.EmergencyStopped, match=r"still present \(emergency stop input 'io\.stop'\)"):
        cell.reset()
    cell.advance("10 ms")
    with pytest.raises(gpac.EmergencyStopped, match=r"'io\.stop'.*'io\.stop2'"):
        cell.reset()
    # The latch names the first cause; the second has its own alarm.
    assert cell.statistics["emergency"] == "emergency stop input 'io.stop'"
    assert {alarm.source for alarm in cell.alarms.active} == {"io.stop", "io.stop2"}
    cell.advance("10 ms")
    with pytest.raises(gpac.EmergencyStopped, match=r"present \(emergency stop input 'io\.stop2'\)"):
        cell.reset()
    cell.advance("10 ms")
    cell.reset()
    assert cell.statistics["emergency"] is None
    bench.arm.enable()


def test_a_short_pulse_of_an_input_latches(cell: gpac.System) -> None:
    bench = Bench(cell, [(10, {"stop": True}), (11, {"stop": False})])
    cell.emergency_stop_input(bench.io["stop"])
    bench.arm.enable()
    cell.advance("30 ms")
    assert cell.statistics["emergency"] == "emergency stop input 'io.stop'"
    cell.reset()
    cell.advance("30 ms")
    assert cell.statistics["emergency"] is None


def test_a_normally_closed_contact_trips_when_it_opens(cell: gpac.System) -> None:
    bench = Bench(cell, [(0, {"closed": True}), (20, {"closed": False}), (40, {"closed": True})])
    cell.advance("5 ms")
    cell.emergency_stop_input(bench.io["closed"], trips=False)
    cell.advance("10 ms")
    assert cell.statistics["emergency"] is None
    cell.advance("10 ms")
    with pytest.raises(gpac.EmergencyStopped, match=r"io\.closed"):
        cell.reset()
    cell.advance("20 ms")
    cell.reset()


def test_losing_the_device_of_an_input_trips_until_it_is_open_again(cell: gpac.System) -> None:
    bench = Bench(cell, fail_at="20 ms", initial=[0.5, 0.5])
    cell.emergency_stop_input(bench.drives["x"].position, trips=False)
    cell.advance("10 ms")
    assert cell.statistics["emergency"] is None
    cell.advance("20 ms")
    assert "device was lost" in cell.statistics["emergency"]
    cell.reset()  # opens it again
    cell.advance("10 ms")
    assert cell.statistics["emergency"] is None
    cell.advance("20 ms")
    assert "device was lost" in cell.statistics["emergency"], "it fails anew"


def test_a_source_that_a_crash_stops_is_blind_and_trips(cell: gpac.System, built: dict[str, str]) -> None:
    bench = Bench(cell)
    cell.emergency_stop_input(bench.far_io["stop"])
    bench.arm.enable()
    moving = move.asynch(bench.arm, goal=[1.0, 1.0])
    bad = gpac.Verb("bad", blocks={"bad": cell.download(built["faults"], "faults").null_pointer}, instantiation_parameters={"y": "bad.y"},
                    command_lists={"start": [gpac.activate("bad", every="1 ms")]})  # fmt: skip
    with pytest.raises(gpac.Terminated, match="fault"):
        bad.on(bench.far)(cell.svv("y", history=0))
    with pytest.raises(gpac.Terminated, match=r"emergency_stop.*far_io\.stop"):
        moving.wait()
    cell.reset()  # the source is started again, and its input is read
    cell.advance("5 ms")
    assert cell.statistics["emergency"] is None
    bench.arm.enable()
    assert move(bench.arm, goal=[0.1, 0.1]).condition == "arrived"


def test_a_stop_before_a_cause_goes_is_not_lifted_by_a_second_stop(cell: gpac.System) -> None:
    bench = Bench(cell)
    cell.emergency_stop("first")
    cell.emergency_stop("second")
    assert cell.statistics["emergency"] == "first"
    assert cell.alarms["emergency_stop"].count == 2
    cell.reset()
    bench.arm.enable()


def test_wrong_inputs_are_refused(cell: gpac.System) -> None:
    bench = Bench(cell)
    cell.emergency_stop_input(bench.io["stop"])
    with pytest.raises(gpac.InUse, match=r"io\.stop"):
        cell.emergency_stop_input(bench.io["stop"])
    with pytest.raises(gpac.CallError):
        cell.emergency_stop_input("io.stop")  # type: ignore[arg-type]
    with pytest.raises(gpac.UnknownName, match="valve"):
        cell.emergency_stop_input(bench.io["valve"])
    with pytest.raises(gpac.InvalidState, match="emergency stop input"):
        bench.io.delete()
