# SPDX-License-Identifier: Apache-2.0
"""Ends, suspensions and second writers: ending lists, the state of actuators meanwhile, queues and aborts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, deactivate, on, wait
from rig import Rig


def braked(rig: Rig, **changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb that counts into `y`; its ending list counts the ms that the brake takes."""
    definition: dict[str, Any] = {
        "blocks": {"count": rig.block("count.count"), "brake": rig.block("count.count")},
        "instantiation_parameters": {"y": "count.y", "b": "brake.y"},
        "command_lists": {
            "start": [activate("count", every="1 ms")],
            "release": [activate("brake", every="1 ms"), wait("3.5 ms"), deactivate("brake")],
        },
        "conditions": {"enough": on("count.enough", returns=["last"]), "halted": on(returns=["last"])},
        "ending": "release",
    }
    return rig.counting("braked", **{**definition, **changes}).on(rig.fast)


def test_an_ending_list_runs_at_every_end_and_the_report_says_why(rig: Rig) -> None:
    y, b = rig.svvs("y", "b")
    report = braked(rig)(y, b, limit=5)
    assert (report.condition, report.command_list, report.last, b.value) == ("enough", "start", 5, 2)
    rig.cell.advance("0.5 ms")
    with braked(rig).new_instance(y, b) as vi:
        vi.start()
        rig.cell.advance("3 ms")
        vi.halt()
        report = vi.wait()
        assert (report.condition, report.last, b.value) == ("halted", y.value, 2)
    rig.cell.advance("0.5 ms")
    with pytest.raises(gpac.Terminated) as ended:
        braked(rig)(y, b, time_limit="2.5 ms")
    assert ended.value.condition == "time_limit" and b.value in (2, 3)


def test_what_a_halt_leads_to_reports_halted(rig: Rig) -> None:
    y, b = rig.svvs("y", "b")
    lists = {
        "start": [activate("count", every="1 ms")],
        "stop": [activate("count", every="1 ms"), wait("2.5 ms"), deactivate("count")],
        "release": [activate("brake", every="1 ms"), wait("1.5 ms"), deactivate("brake")],
    }
    verb = braked(rig, command_lists=lists, initial="start", transitions={("start", "halted"): "stop"})
    vi = verb.asynch(y, b)
    rig.cell.advance("3 ms")
    vi.halt()
    report = vi.wait()
    assert (report.condition, report.command_list, report.last) == ("halted", "stop", 4) and b.value in (0, 1)


def test_wrong_endings_are_refused_where_they_are_written(memory_rig: Rig) -> None:
    with pytest.raises(gpac.UnknownName, match=r"the ending list 'relase' of verb 'braked' does not exist; did you mean 'release'"):
        braked(memory_rig, ending="relase", initial="start")
    with pytest.raises(gpac.DefinitionError, match="enters the ending list"):
        braked(memory_rig, transitions={("start", "enough"): "release"})
    with pytest.raises(gpac.DefinitionError, match="suspend= of verb 'braked' must be a policy, not 'stop'"):
        braked(memory_rig, suspend="stop")


def test_a_verb_that_comes_to_rest_is_suspended_when_it_has(rig: Rig) -> None:
    y, v = rig.svvs("y", "v")
    rest = gpac.Verb(
        "rest",
        blocks={"ramp": rig.block("ramp.ramp")},
        instantiation_parameters={"y": "ramp.y", "v": "ramp.v"},
        command_lists={"start": [activate("ramp", every="1 ms")]},
        suspend=gpac.holding("ramp.holding", "ramp.held"),
    ).on(rig.fast)
    with rest.new_instance(y, v) as vi:
        vi.start()
        rig.cell.advance("5 ms")
        vi.suspend()
        assert (vi.state, y.value, v.value, rig.cell.now) == ("suspended", 15, 0, pytest.approx(0.008))
        rig.cell.advance("10 ms")
        assert y.value == 15
        vi.resume()
        rig.cell.advance("2 ms")
        assert (vi.state, y.value, v.value) == ("running", 18, 2)


@pytest.mark.parametrize("arbitration", ["refuse", "queue", "abort"])
def test_two_verbs_that_want_one_device(rig: Rig, arbitration: str) -> None:
    class Slide(gpac.LogicalDevice, name=f"Slide {arbitration}", arbitration=arbitration):
        y = gpac.svv()

    slide = Slide("slide", system=rig.cell).enable()
    push = rig.counting("push", objects={"slide": Slide}, instantiation_parameters={"slide.y": "count.y"}).on(rig.fast)
    first = push.named("first").asynch(slide, limit=9)
    rig.cell.advance("4 ms")
    if arbitration == "refuse":
        with pytest.raises(gpac.SecondWriter, match=r"'second'.*'slide.y' is written by 'first'"):
            push.named("second").asynch(slide, limit=5)
        assert first.wait().last == 9
        return
    second = push.named("second").asynch(slide, limit=5, time_limit="8 ms")
    if arbitration == "queue":
        assert (first.state, second.state, slide.state) == ("running", "queued", "moving")
        third = push.asynch(slide)
        third.halt()
        assert third.wait().condition == "halted"
        assert (first.wait().last, second.wait().last) == (9, 5)
    else:
        rig.cell.advance("1 ms")
        assert (second.state, slide.y.value) == ("running", 0)
        with pytest.raises(gpac.Terminated, match="aborted"):
            first.wait()
        assert second.wait().last == 5


def test_a_motion_is_suspended_and_resumed_without_a_jump() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system as cell:
        arm.enable()
        vi = gpac.robots.move.asynch(arm, goal=gpac.deg([30, -70, 70, -80, -80, 20]), speed=1.0)
        cell.advance("200 ms")
        vi.suspend()
        held = arm.values("commanded")
        assert vi.state == "suspended" and held[0] > 0.1, "it has slowed down on its way, within its limits"
        cell.advance("300 ms")
        assert arm.values("commanded") == held, "what is commanded stands still"
        vi.resume()
        assert vi.wait().condition == "arrived"
        for joint in arm:
            rows = joint.reference.history[:]
            assert (np.diff(rows["number"]) == 1).all(), "every invocation of the servo"
            assert np.abs(np.diff(rows["value"])).max() / 1e-3 <= 1.0 + 1e-6, "no faster than it was asked for"
            assert np.abs(np.diff(rows["value"], 2)).max() / 1e-6 <= joint.max_acceleration * (1 + 1e-6)


def test_a_servo_is_exchanged_while_a_verb_uses_its_device(rig: Rig) -> None:
    def servo(name: str) -> gpac.Verb[..., Any]:
        return gpac.Verb(
            name,
            blocks={"ramp": rig.block("ramp.ramp"), "count": rig.block("count.count")},
            instantiation_parameters={"sensed": "ramp.y", "n": "count.y"},
            command_lists={"start": [activate("ramp", every="1 ms"), activate("count", every="1 ms"), gpac.ready()]},
        )

    class Drive(gpac.LogicalDevice, verb=servo("first servo")):
        sensed = gpac.svv()
        n = gpac.svv()
        commanded = gpac.svv()

    drive = Drive("drive", on=rig.fast).enable()
    push = rig.counting("push", objects={"drive": Drive}, instantiation_parameters={"drive.commanded": "count.y"}).on(rig.fast)
    vi = push.asynch(drive, limit=9)
    rig.cell.advance("5 ms")
    before = (drive.sensed.value, drive.n.value)
    drive.exchange_verb(servo("second servo"))
    assert (drive.sensed.value, drive.n.value, vi.state) == (*before, "running")
    rig.cell.advance("1 ms")
    assert (drive.sensed.value, drive.n.value) == (before[0] + 3, before[1] + 1), "states and numbers are kept"
    assert vi.wait().last == 9
    with pytest.raises(gpac.InUse, match="second servo"):
        drive.exchange_verb(servo("second servo"))


def test_a_composed_verb_has_the_ending_list_of_the_part_that_has_one(memory_rig: Rig) -> None:
    rig = memory_rig
    y, b, z = rig.svvs("y", "b", "z")
    after = rig.counting("after", instantiation_parameters={"z": "count.y"})
    whole = gpac.compose("whole", {"first": braked(rig), "then": after}, transitions={("first.start", "enough"): "then.start"})
    report = whole.on(rig.fast)(y, b, z, limit=4)
    assert (report.condition, report.command_list, b.value) == ("enough", "then.start", 2)
    with pytest.raises(gpac.CompositionConflict, match="both have an ending list"):
        gpac.compose("twice", {"first": braked(rig), "then": braked(rig)}, transitions={("first.start", "enough"): "then.start"})
