# SPDX-License-Identifier: Apache-2.0
"""The program from which the Python interface was designed runs, on both interconnects."""

from __future__ import annotations

import functools
import runpy
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from listings import ROOT

import opengpac as gpac

FAULTY = {"kind": "message", "seed": 7, "delay_ns": [0, 100_000], "drop": 0.02, "repeat": 0.02, "reorder": 0.02, "corrupt": 0.01}


@pytest.fixture(params=["memory", FAULTY], ids=["memory", "message"])
def names(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    """Yields the names defined by the program after it has run, in a folder with the arm and the blocks that it uses."""
    shutil.copy(ROOT / "python/opengpac/robots/ur5e.xml", tmp_path)
    shutil.copy(ROOT / "examples/blocks/lowpass.c", tmp_path / "my_blocks.c")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(gpac, "System", functools.partial(gpac.System, interconnect=request.param))
    names = runpy.run_path(str(ROOT / "tests/docs/design_listing.py"))
    yield names
    names["cell"].close()


def test_the_design_listing_moves_the_arm(names: dict[str, Any]) -> None:
    report = names["r"]
    assert type(report) is names["Moved"]
    assert report.condition == "arrived" and 0 < report.time < 10
    assert np.allclose(report.position, gpac.deg([0, -90, 90, 0, 0, 0]), atol=0.01)


def test_its_devices_are_joints_of_the_arm(names: dict[str, Any]) -> None:
    assert [joint.name for joint in names["arm"]] == names["ur5e"].parts
    assert {joint.state for joint in names["arm"]} == {"standstill"}
    assert "lowpass" in repr(names["code"])


def test_its_conditions_raise_its_classes(names: dict[str, Any]) -> None:
    move, arm, slow = names["move"], names["arm"], names["slow"]
    with pytest.raises(names["MotionTimeout"]) as caught:
        move.on(slow)(arm, goal=gpac.deg([90, -90, 90, 0, 0, 0]), time_limit="0.5 s")
    assert (caught.value.condition, caught.value.command_list) == ("time_limit", "start")


def test_its_verb_is_called_in_all_three_ways(names: dict[str, Any]) -> None:
    cell, move, arm, slow = names["cell"], names["move"], names["arm"], names["slow"]
    cell.place({"move.*": slow})
    there = ["0 deg", "-85 deg", "85 deg", "0 deg", "0 deg", "0 deg"]
    assert move(arm, goal=there, speed="30 deg/s").condition == "arrived"
    vi = move.asynch(arm, goal=gpac.deg([0, -90, 90, 0, 0, 0]))
    assert (vi.state, vi.wait().condition, vi.state) == ("running", "arrived", "deleted")
    vi = move.new_instance(arm)
    assert vi.start(arm.values("sensed"), 0.5).wait().condition == "arrived"
    assert vi.start(arm.values("sensed"), speed=0.4).wait().condition == "arrived"
    vi.delete()
