# SPDX-License-Identifier: Apache-2.0
"""The program from which the Python interface was designed runs."""

from __future__ import annotations

import runpy
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from listings import ROOT

import opengpac as gpac


@pytest.fixture
def names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """What the program has defined when it has run, in a folder with the arm and the blocks that it asks for."""
    shutil.copy(ROOT / "python/opengpac/robots/ur5e.xml", tmp_path)
    shutil.copy(ROOT / "examples/blocks/lowpass.c", tmp_path / "my_blocks.c")
    monkeypatch.chdir(tmp_path)
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
