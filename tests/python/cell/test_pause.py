# SPDX-License-Identifier: Apache-2.0
"""Pause and resume of a program: actions stand still, servos hold, starts are deferred."""

from __future__ import annotations

import threading
from typing import Any

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.robots import move


@pytest.fixture
def bench(cell: gpac.System) -> Bench:
    made = Bench(cell)
    made.arm.enable()
    return made


def watching(bench: Bench) -> gpac.VerbInstance[Any]:
    """Starts a verb that acts on no device."""
    verb = gpac.Verb(
        "watching", blocks={"read": gpac.library.read_digital}, instantiation_parameters={"channel": "read.channel"},
        command_lists={"start": [gpac.activate("read", every="1 ms")]},
    )  # fmt: skip
    return verb.on(bench.fast).named("watching").asynch(channel=bench.io["gate"])


def test_actions_stand_still_and_go_on(cell: gpac.System, bench: Bench) -> None:
    watch, moving = watching(bench), move.asynch(bench.arm, goal=[1.0, 0.5])
    cell.advance("200 ms")
    assert cell.pause() == [moving.name]
    assert (moving.state, watch.state, cell.paused) == ("suspended", "running", True)
    cell.advance("500 ms")  # the servo comes to the last setpoint
    before, commanded = bench.arm.values("sensed"), bench.arm.values("commanded")
    cell.advance("1 s")
    assert bench.arm.values("commanded") == commanded
    assert bench.arm.values("sensed") == pytest.approx(before, abs=1e-6)
    assert [joint.state for joint in bench.arm] == ["moving", "moving"]
    assert cell.resume() == [moving.name]
    assert (moving.state, cell.paused) == ("running", False)
    report = moving.wait()
    assert report.condition == "arrived"
    assert bench.arm.values("sensed") == pytest.approx([1.0, 0.5], abs=0.01)


def test_what_is_started_meanwhile_is_held_back(cell: gpac.System, bench: Bench) -> None:
    assert cell.pause() == []
    moving = move.asynch(bench.arm, goal=[0.3, 0.3])
    assert moving.state == "suspended"
    cell.advance("1 s")
    assert bench.arm.values("sensed") == pytest.approx([0.0, 0.0], abs=1e-9)
    with pytest.raises(gpac.SecondWriter, match=moving.name):
        move.asynch(bench.arm, goal=[0.1, 0.1])
    assert cell.resume() == [moving.name]
    report = moving.wait()
    assert report.condition == "arrived"
    assert bench.arm.values("sensed") == pytest.approx([0.3, 0.3], abs=0.01)


def test_the_time_limit_of_a_held_back_start_counts_from_its_beginning(cell: gpac.System, bench: Bench) -> None:
    cell.pause()
    moving = move.asynch(bench.arm, goal=[0.1, 0.1], time_limit="5 s")
    cell.advance("10 s")
    assert moving.state == "suspended"
    cell.resume()
    assert moving.wait().condition == "arrived"


def test_ends_while_paused(cell: gpac.System, bench: Bench) -> None:
    moving = move.asynch(bench.arm, goal=[1.0, 1.0])
    cell.advance("100 ms")
    cell.pause()
    moving.halt()
    assert moving.state == "ended"
    held = move.asynch(bench.arm, goal=[0.5, 0.5])
    held.halt()
    assert held.wait().condition == "halted"
    assert cell.resume() == []
    # Nothing is left of them.
    again = move(bench.arm, goal=[0.2, 0.2])
    assert again.condition == "arrived"


def test_a_held_back_instance_can_be_started_again_and_begins_anew(cell: gpac.System, bench: Bench) -> None:
    instance = move.new_instance(bench.arm)
    cell.pause()
    instance.start(goal=[0.5, 0.5])
    instance.halt()
    instance.start(goal=[0.1, 0.1])
    cell.resume()
    assert instance.wait().condition == "arrived"
    assert bench.arm.values("sensed") == pytest.approx([0.1, 0.1], abs=0.01)


def test_the_emergency_stop_ends_what_is_paused_and_the_pause(cell: gpac.System, bench: Bench) -> None:
    moving = move.asynch(bench.arm, goal=[1.0, 1.0])
    cell.advance("100 ms")
    cell.pause()
    cell.emergency_stop("pressed")
    with pytest.raises(gpac.Terminated, match="pressed"):
        moving.wait()
    assert cell.paused is False
    cell.reset()
    bench.arm.enable()
    assert move(bench.arm, goal=[0.1, 0.1]).condition == "arrived"


def test_disabling_a_device_ends_what_is_held_back(cell: gpac.System, bench: Bench) -> None:
    cell.pause()
    held = move.asynch(bench.arm, goal=[0.5, 0.5])
    bench.arm.disable()
    with pytest.raises(gpac.Terminated, match="device_disabled"):
        held.wait()


def test_a_group_is_paused_by_itself(cell: gpac.System, bench: Bench) -> None:
    x, y = (gpac.Group(joint.short_name, joint) for joint in bench.arm)
    first, second = move.asynch(x, goal=[0.5]), move.asynch(y, goal=[0.5])
    cell.advance("100 ms")
    assert x.pause() == [first.name]
    assert (first.state, second.state, cell.paused) == ("suspended", "running", ["arm.x"])
    assert second.wait().condition == "arrived"
    # The system's pause is added: x continues only when no pause covers it.
    cell.pause()
    x.resume()
    assert first.state == "suspended"
    assert cell.resume() == [first.name]
    assert first.wait().condition == "arrived"


def test_what_somebody_suspended_himself_stays_suspended(cell: gpac.System, bench: Bench) -> None:
    moving = move.asynch(bench.arm, goal=[0.5, 0.5])
    cell.advance("100 ms")
    moving.suspend()
    assert cell.pause() == []
    with pytest.raises(gpac.InvalidState, match="paused with the program"):
        moving.resume()
    assert cell.resume() == []
    assert moving.state == "suspended"
    moving.resume()
    assert moving.wait().condition == "arrived"


def test_pausing_twice_is_pausing_once(cell: gpac.System, bench: Bench) -> None:
    moving = move.asynch(bench.arm, goal=[0.5, 0.5])
    cell.advance("100 ms")
    assert (cell.pause(), cell.pause()) == ([moving.name], [])
    assert (cell.resume(), cell.resume()) == ([moving.name], [])
    assert moving.wait().condition == "arrived"


def test_a_system_is_closed_while_it_is_paused() -> None:
    with gpac.System("paused", clock="virtual") as cell:
        bench = Bench(cell)
        bench.arm.enable()
        moving = move.asynch(bench.arm, goal=[1.0, 1.0])
        cell.advance("100 ms")
        cell.pause()
    assert moving.system.closed


def test_two_threads_pause_and_resume() -> None:
    with gpac.System("threads") as cell:
        bench = Bench(cell)
        bench.arm.enable()
        moving = move.asynch(bench.arm, goal=[0.2, 0.2])
        failed: list[BaseException] = []

        def worry() -> None:
            try:
                for _ in range(50):
                    cell.pause()
                    cell.resume()
            except BaseException as error:
                failed.append(error)

        threads = [threading.Thread(target=worry) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        cell.resume()
        assert not failed
        assert moving.wait(timeout="60 s").condition == "arrived"


def test_wrong_devices_are_refused(cell: gpac.System, bench: Bench) -> None:
    with pytest.raises(gpac.CallError, match="logical devices"):
        cell.pause("arm")  # type: ignore[arg-type]
    with pytest.raises(gpac.CallError):
        cell.resume(bench.arm)  # type: ignore[arg-type]
