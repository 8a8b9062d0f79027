# SPDX-License-Identifier: Apache-2.0
"""A page offers motions of joints without a line of program."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac.studio import server

OFFERED = {"jog", "move_absolute", "move_relative", "stop"}


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
    # What a program says besides stays possible.
    cell.svv("studio.heartbeat", int)
    group = cell.devices["ur5e.elbow"].enable()
    assert gpac.motion.move_absolute(group, 1.0).condition == "arrived"


def test_a_page_that_only_looks_is_offered_nothing(cell: gpac.System, page: Path) -> None:
    arm(cell)
    cell._served(server.serve(cell, 0, "observe", page=page))
    assert not OFFERED & {*cell.names["verbs"]}


def test_what_a_program_has_defined_under_a_name_stays(cell: gpac.System, page: Path) -> None:
    own = gpac.Verb("stop", blocks={"wave": gpac.library.signal_generator}, command_lists={"start": [gpac.activate("wave", every="1 ms")]})
    fast = cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    own.on(fast).new_instance()
    arm(cell)
    cell._served(server.serve(cell, 0, "operate", page=page))
    (stop,) = (verb for verb in cell.verbs if verb.name == "stop")
    assert "acts on" not in str(stop)
