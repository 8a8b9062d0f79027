# SPDX-License-Identifier: Apache-2.0
"""Taught points: a text file that people edit too; no edit can break it."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.devices.points import model_of
from opengpac.robots import Joint, load, move
from opengpac.storage import files


@pytest.fixture
def bench(cell: gpac.System) -> Bench:
    made = Bench(cell, initial=[0.25, -0.5])
    made.arm.enable()
    return made


def test_a_taught_point_is_a_goal(cell: gpac.System, bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm)
    assert (len(points), list(points), points.joints) == (0, [], [])
    pick = points.teach("pick", note="above the tray")
    assert dict(pick) == pytest.approx({"x": 0.25, "y": -0.5})
    move(bench.arm, goal=[0.0, 0.0])
    report = move(bench.arm, goal=points["pick"])
    assert report.position == pytest.approx([0.25, -0.5], abs=0.01)
    again = gpac.Points(tmp_path / "points.toml", bench.arm)["pick"]
    assert (dict(again), again.note, again.frame) == (dict(pick), "above the tray", "joints")
    assert again.array == pytest.approx([0.25, -0.5])
    # One joint's goal is merged into the present positions, as with any goal.
    move(bench.arm, goal={"x": again["x"] + 0.1})
    assert bench.arm.values("sensed") == pytest.approx([0.35, -0.5], abs=0.01)


def test_edit_rename_delete(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm)
    points["a"] = [0.1, 0.2]
    points["b"] = {"y": 0.4, "x": 0.3}
    points["copy"] = points["a"]
    points.edit("a", {"y": 1.5}, note="by hand")
    points.rename("b", "c")
    del points["copy"]
    assert list(points) == ["a", "c"], "the order stays"
    assert (dict(points["a"]), dict(points["c"]), points["a"].note) == ({"x": 0.1, "y": 1.5}, {"x": 0.3, "y": 0.4}, "by hand")
    assert "x 0.1" in repr(points)
    assert "c" in points
    assert "b" not in points


def test_the_file_reads_well_and_keeps_what_people_write(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "points.toml"
    points = gpac.Points(path, bench.arm)
    points.teach("pick")
    text = path.read_text()
    lines = ("[arm]", 'joints = ["x", "y"]', 'units = ["rad", "rad"]', "pick = {joints = [0.25, -0.5]")
    assert [line for line in lines if line not in text] == []
    path.write_text(text.replace("pick =", "# the tray was moved in spring\npick =").replace("0.25", "0.75"))
    assert points["pick"]["x"] == 0.75, "an editor's change is read"
    points["place"] = [0.0, 0.0]
    points.rename("pick", "tray 1")
    points.rename("tray 1", "pick")
    lines = [line.split(" = ")[0] for line in path.read_text().split("\n") if line.startswith(("# the", "pick", "place"))]
    assert lines == ["# the tray was moved in spring", "pick", "place"]
    assert points["pick"]["x"] == 0.75


def test_degrees_may_stand_in_the_file(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "points.toml"
    points = gpac.Points(path, bench.arm)
    points["a"] = [1.0, 2.0]
    path.write_text(path.read_text().replace('units = ["rad", "rad"]', 'units = ["deg", "rad"]').replace("[1.0, ", "[90, "))
    assert points["a"]["x"] == pytest.approx(math.pi / 2)
    points.edit("a", {"x": math.pi})
    assert "[180.0, 2.0]" in path.read_text()


def test_points_of_another_arm_are_refused(cell: gpac.System, bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "points.toml"
    gpac.Points(path, bench.arm).teach("pick")
    other = gpac.Group("other", bench.arm.x)
    with pytest.raises(gpac.ValueRefused, match="are for joints x, y, but arm 'other' has x"):
        gpac.Points(path, other)
    with pytest.raises(gpac.ValueRefused, match="are for joints x, y"):
        gpac.Points(path).teach("pick", other)
    twin = gpac.Group("twin", *bench.arm)
    twin.model = "file:0123"
    with pytest.raises(gpac.ValueRefused, match="a model of arm 'arm' that differs from the model of 'twin'"):
        gpac.Points(path, twin)
    assert gpac.Points(path, twin, any_model=True)["pick"]["x"] == 0.25


def test_the_model_of_a_loaded_arm_is_its_file(tmp_path: Path) -> None:
    mjcf = Path(gpac.robots.__file__).parent / "ur5e.xml"
    changed = tmp_path / "ur5e.xml"
    changed.write_text(mjcf.read_text() + "<!-- longer by a link -->\n")
    with gpac.System("one", clock="virtual") as one, gpac.System("two", clock="virtual") as two:
        arms = [
            load(file, on=cell.processor("rtp0").timer("fast", period="1 ms", priority=80)) for cell, file in ((one, mjcf), (two, changed))
        ]
        gpac.Points(tmp_path / "points.toml", arms[0])["home"] = [0.0] * 6
        gpac.Points(tmp_path / "points.toml", arms[0])
        with pytest.raises(gpac.ValueRefused, match="differs from the model of"):
            gpac.Points(tmp_path / "points.toml", arms[1])


def test_a_joint_alone_has_points(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm.y)
    points.teach("up")
    assert dict(points["up"]) == {"y": -0.5}


def test_a_disabled_arm_is_not_taught(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm)
    bench.arm.y.disable()
    with pytest.raises(gpac.NotEnabled, match=r"arm\.y"):
        points.teach("pick")
    assert not (tmp_path / "points.toml").exists()


HEAD = "format = 1\n[arm]\nname='a'\nmodel='m'\njoints=['elbow']\nunits=['rad']\n[points.p]\n"
LINES = "format = 2\n[arm]\nname='a'\nmodel='m'\njoints=['elbow']\nunits=['rad']\n[points]\n"
DAMAGE = {
    "no toml": ("format = [", "cannot be read"),
    "empty": ("", "format"),
    "newer": ("format = 3\n", "format is 3"),
    "no tables": ("format = 1\n", r"\[arm\] and \[points\]"),
    "no units": ("format = 1\n[arm]\nname='a'\nmodel='m'\njoints=['x']\n[points]\n", "'units'"),
    "unit": (HEAD.replace("rad", "turns"), "turns"),
    "units": (HEAD.replace("['rad']", "['rad', 'rad']"), "1 joints but 2 units"),
    "no joints": (HEAD, "no 'joints"),
    "joint": (HEAD + "joints={elbov=1}\n", "did you mean 'elbow'"),
    "missing": (HEAD + "joints={}\n", "'elbow' is missing"),
    "nan": (HEAD + "joints={elbow=nan}\n", "must be finite, not"),
    "text": (HEAD + "joints={elbow='1'}\n", "must be finite, not"),
    "frame": (HEAD + "joints={elbow=1}\nframe='table'\n", r"line 7, cannot be used: point 'p': its frame 'table' is not in \[frames\]"),
    "count": (LINES + "p = {joints = [1, 2]}\n", r"line 8, cannot be used: point 'p': it has 2 joints, but the arm has 1: elbow"),
    "no pose": (LINES + "p = {joints = [1], frame = 'world'}\n", "point 'p': it has no 'position"),
    "no frame": (LINES + "p = {joints = [1], position = [1, 2, 3]}\n", "its frame is 'joints'"),
    "far": (LINES + "p = {joints = [1], frame = 'world', position = [1, 2e30, 3]}\n", "coordinate of a pose"),
    "signs": (LINES + "p = {joints = [1], frame = 'world', position = [1, 2, 3], configuration = '+'}\n", "three signs"),
    "turns": (
        LINES + "p = {joints = [1], frame = 'world', position = [1, 2, 3], turns = [0.5]}\n",
        "its turns must be an integer for each joint",
    ),
    "tool": (LINES + "p = {joints = [1], frame = 'world', position = [1, 2, 3], tool = 'x'}\n", r"tool 'x' is not in \[tools\]"),
    "work frame": (LINES + "[frames]\ntable = {position = [1, 2]}\n", r"line 9, cannot be used: frame 'table': it has no 'position"),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=list(DAMAGE))
def test_a_damaged_file_is_refused_and_left_as_it_is(tmp_path: Path, damage: tuple[str, str]) -> None:
    text, says = damage
    path = tmp_path / "points.toml"
    path.write_text(text)
    with pytest.raises(gpac.FileFailed, match=says):
        gpac.Points(path)
    assert path.read_text() == text


def test_a_file_that_becomes_damaged_is_not_written_over(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "points.toml"
    points = gpac.Points(path, bench.arm)
    points.teach("pick")
    path.write_text("half a li")
    for call in (lambda: points.teach("pick"), lambda: points["pick"], lambda: points.rename("pick", "a"), lambda: list(points)):
        with pytest.raises(gpac.FileFailed):
            call()
    assert path.read_text() == "half a li"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(gpac.FileFailed, match="is not valid UTF-8"):
        points.teach("pick")


def test_a_full_disk_loses_nothing(bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "points.toml"
    points = gpac.Points(path, bench.arm)
    points.teach("pick")
    before = path.read_text()

    def full(_: int) -> None:
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as disk:
        disk.setattr(files.os, "fsync", full)
        with pytest.raises(gpac.FileFailed, match="no space left on device"):
            points["place"] = [1.0, 1.0]
    assert path.read_text() == before
    assert [file.name for file in tmp_path.iterdir()] == ["points.toml"]
    assert dict(points["place"]) == {"x": 1.0, "y": 1.0}, "it is kept in memory"
    points.save()
    assert "place" in gpac.Points(path, bench.arm)


def test_a_folder_that_is_not_there(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "missing" / "points.toml", bench.arm)
    with pytest.raises(gpac.FileFailed, match="no such file or directory"):
        points.teach("pick")
    (tmp_path / "missing").mkdir()
    points.save()
    assert "pick" in gpac.Points(points.path)


def test_a_link_stays_a_link(bench: Bench, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    real, link = tmp_path / "real" / "points.toml", tmp_path / "points.toml"
    link.symlink_to(real)
    gpac.Points(link, bench.arm).teach("pick")
    assert link.is_symlink()
    assert real.exists()


def test_two_threads_lose_no_point(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm)
    points["start"] = [0.0, 0.0]

    def write(thread: int) -> None:
        for k in range(10):
            points[f"p{thread}_{k}"] = [thread, k]

    threads = [threading.Thread(target=write, args=(thread,)) for thread in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(gpac.Points(points.path)) == 31


OLD = """# by hand
format = 1

[arm]
name = "arm"
model = "MODEL"
joints = ["x", "y"]
units = ["rad", "rad"]

[points.pick]  # the tray
frame = "joints"
joints = {x = 0.25, y = -0.5}
note = "above"

# at the wall
[points."far away"]
frame = "joints"
joints = {x = 1.0, y = 0.0}
"""


def test_a_file_of_an_earlier_version_stays_as_it_is(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "points.toml"
    old = OLD.replace("MODEL", model_of(bench.arm))
    path.write_text(old)
    points = gpac.Points(path, bench.arm)
    assert [(point.name, dict(point), point.note) for point in points.values()] == [
        ("pick", {"x": 0.25, "y": -0.5}, "above"), ("far away", {"x": 1.0, "y": 0.0}, ""),
    ]  # fmt: skip
    points.edit("pick", {"x": 0.5})
    points.rename("far away", "wall")
    assert path.read_text() == old.replace("x = 0.25", "x = 0.5").replace('"far away"', "wall")
    points["new"] = [0.0, 1.0]
    assert path.read_text().endswith('\n[points.new]\nframe = "joints"\njoints = {x = 0.0, y = 1.0}\n')
    assert list(gpac.Points(path, bench.arm)) == ["pick", "wall", "new"]


PROGRAM = """
import sys
import opengpac as gpac
points = gpac.Points(sys.argv[1])
for number in range(15):
    points[f"{sys.argv[2]}{number}"] = [float(number), 0.0]
"""


def test_two_programs_lose_no_point(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm)
    points["start"] = [0.0, 0.0]
    programs = [subprocess.Popen([sys.executable, "-c", PROGRAM, points.path, letter]) for letter in "ab"]
    for number in range(15):
        points[f"c{number}"] = [0.0, float(number)]
    assert [program.wait(60) for program in programs] == [0, 0]
    assert sorted(points) == sorted(["start", *(f"{letter}{number}" for letter in "abc" for number in range(15))])


def test_a_point_that_could_not_be_written_does_not_take_that_of_another(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, other = (gpac.Points(tmp_path / "points.toml", bench.arm) for _ in range(2))

    def full(_: int) -> None:
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as disk:
        disk.setattr(files.os, "fsync", full)
        with pytest.raises(gpac.FileFailed):
            points["mine"] = [1.0, 1.0]
    other["theirs"] = [2.0, 2.0]
    assert sorted(points) == ["mine", "theirs"]
    points.save()
    assert sorted(other) == ["mine", "theirs"]


def test_wrong_names_and_values_are_refused(bench: Bench, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", bench.arm)
    points["pick"] = [0.1, 0.2]
    before = points.path.read_text()
    cases: list[tuple[type[Exception], Any]] = [
        (gpac.UnknownName, lambda: points["pik"]),
        (gpac.UnknownName, lambda: points["pick"]["z"]),
        (gpac.UnknownName, lambda: points.edit("pick", {"z": 1.0})),
        (gpac.UnknownName, lambda: points.rename("place", "a")),
        (gpac.ValueRefused, lambda: points.__setitem__("a", [1.0])),
        (gpac.ValueRefused, lambda: points.__setitem__("a", [1.0, math.nan])),
        (gpac.ValueRefused, lambda: points.__setitem__("a", ["1", "2"])),
        (gpac.ValueRefused, lambda: points.__setitem__("a", "xy")),
        (gpac.UnknownName, lambda: points.__setitem__("a", {"x": 1.0})),
        (gpac.CallError, lambda: points.__setitem__("", [1.0, 1.0])),
        (gpac.CallError, lambda: points.teach(7)),  # type: ignore[arg-type]
        (gpac.CallError, lambda: gpac.Points(points.path, "arm")),  # type: ignore[arg-type]
        (gpac.CallError, lambda: gpac.Points(tmp_path / "new.toml").teach("pick")),
    ]
    for kind, call in cases:
        with pytest.raises(kind):
            call()
    points["a"] = [0.0, 0.0]
    with pytest.raises(gpac.ValueRefused, match="already"):
        points.rename("a", "pick")
    del points["a"]
    assert points.path.read_text() == before
    assert Joint.definition_name() == "robot_joint"
