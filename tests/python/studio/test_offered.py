# SPDX-License-Identifier: Apache-2.0
"""A page offers motions of joints without any program."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac.studio import server

OFFERED = {"jog", "move_absolute", "move_relative", "stop", "jog_linear", "move_linear"}


@pytest.fixture
def page(tmp_path: Path) -> Path:
    (tmp_path / "index.html").write_text("<html></html>")
    return tmp_path


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("offered", clock="virtual") as cell:
        yield cell


def arm(cell: gpac.System) -> gpac.robots.Arm:
    rtp = cell.processor("rtp0")
    return gpac.robots.load("ur5e", rtp, on=rtp.timer("fast", period="1 ms", priority=80))


@pytest.mark.parametrize("is_there", [True, False])
def test_motions_of_joints_are_offered_where_a_page_may_start_them(cell: gpac.System, page: Path, is_there: bool) -> None:
    if is_there:
        arm(cell)
    cell._served(server.serve(cell, 0, "operate", page=page))
    if not is_there:
        assert not OFFERED & {*cell.names["verbs"]}, "there is nothing that they could move"
        arm(cell)
    assert {*cell.names["verbs"]} >= OFFERED
    assert "studio.heartbeat" in cell.names["svvs"]
    # Other commands of a program remain possible.
    cell.svv("studio.heartbeat", int)
    group = cell.devices["ur5e.elbow"].enable()
    assert gpac.motion.move_absolute(group, 1.0).condition == "arrived"


def test_a_page_that_only_looks_is_offered_nothing(cell: gpac.System, page: Path) -> None:
    arm(cell)
    cell._served(server.serve(cell, 0, "observe", page=page))
    assert not OFFERED & {*cell.names["verbs"]}
    assert [one["name"] for one in cell._alive().arms()] == ["ur5e"], "it shows the pose of the tool"


def test_what_a_program_has_defined_under_a_name_stays(cell: gpac.System, page: Path) -> None:
    own = gpac.Verb("stop", blocks={"wave": gpac.library.signal_generator}, command_lists={"start": [gpac.activate("wave", every="1 ms")]})
    fast = cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    own.on(fast).new_instance()
    arm(cell)
    cell._served(server.serve(cell, 0, "operate", page=page))
    (stop,) = (verb for verb in cell.verbs if verb.name == "stop")
    assert "acts on" not in str(stop)


def test_the_system_is_told_the_geometry_of_an_arm_and_each_tool_that_it_gets(cell: gpac.System, page: Path) -> None:
    robot = arm(cell)
    cell._served(server.serve(cell, 0, "operate", page=page))
    (told,) = cell._alive().arms()
    assert told == {"name": "ur5e", "joints": [joint.name for joint in robot], "chain": robot.chain, "missing": ""}
    robot.tool = gpac.Frame((0, 0, "120 mm"))
    robot.base = gpac.Frame(("1 m", 0, 0))
    (told,) = cell._alive().arms()
    assert told["chain"] == robot.chain
    robot[0].disable()
    robot[0].delete()
    assert cell._alive().arms() == [], "an arm that lacks a joint moves no tool"


def test_an_arm_without_geometry_says_why(cell: gpac.System, page: Path) -> None:
    def unknown() -> gpac.robots.Kinematics:
        raise gpac.DefinitionError("its file has no tool")

    robot = gpac.robots.Arm("bare", *arm(cell), kinematics=unknown)
    robot._offer()
    cell._served(server.serve(cell, 0, "operate", page=page))
    told = {one["name"]: one for one in cell._alive().arms()}
    assert told["bare"]["chain"] is None
    assert told["bare"]["missing"] == "its file has no tool"


def test_outputs_can_be_set_where_a_page_may_start_verbs(cell: gpac.System, page: Path) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    io = cell.processor("rtp0").physical_device("io", gpac.drivers.loopback("x"), exchange=fast)
    cell._served(server.serve(cell, 0, "operate", page=page))
    assert "set_analog_output" not in cell.names["verbs"]
    gpac.cell.AnalogOutput("level", io["x"]["effort"])
    assert "set_analog_output" in cell.names["verbs"]
    assert "set_digital_output" not in cell.names["verbs"], "there is none"
