# SPDX-License-Identifier: Apache-2.0
"""Taught points of a page and of a program are in one file: each reads and changes the other's entries, and nothing is lost."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac.studio import server


class Rig:
    """Arm with points of a program, and the calls that a page makes."""

    def __init__(self, folder: Path, cell: gpac.System) -> None:
        (folder / "page").mkdir()
        (folder / "page" / "index.html").write_text("<html></html>")
        rtp = cell.processor("rtp0")
        self.arm = gpac.robots.load("ur5e", rtp, on=rtp.timer("fast", period="1 ms", priority=80)).enable()
        cell._served(server.serve(cell, 0, "operate", page=folder / "page"))
        self.calls = cell._alive()
        self.home = [round(q, 9) for q in self.arm.values("sensed")]

    def page(self) -> dict[str, Any]:
        """Returns the points by name, as the page sees them."""
        return {one["name"]: one for one in self.calls.points("ur5e")["points"]}


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    with gpac.System("cell", clock="virtual") as cell:
        yield Rig(tmp_path, cell)


def test_points_of_a_program_and_of_a_page_are_in_one_file(rig: Rig, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", rig.arm)
    points.frames["table"] = gpac.Frame((0.3, 0.1, 0.05), rpy=(0, 0, "20 deg"))
    points.tools["gripper"] = gpac.Frame((0, 0, "120 mm"))
    points.teach("home")
    points.teach("pick", frame="table", tool="gripper", note="above the tray")
    seen = rig.calls.points("ur5e")
    assert seen["file"] == str(points.path)
    assert [one["name"] for one in seen["frames"]] == ["table"]
    assert seen["tools"] == [{"name": "gripper", "position": [0, 0, 0.12], "rpy_deg": [0, 0, 0]}]
    pick = rig.page()["pick"]
    assert (pick["frame"], pick["tool"], pick["note"]) == ("table", "gripper", "above the tray")
    assert pick["joints"] == pytest.approx([*points["pick"].taught_joints.values()], abs=1e-9)
    configuration = points["pick"].configuration
    assert configuration is not None and pick["configuration"] == configuration.signs
    # The program reads the page's entries.
    rig.calls.teach_point("ur5e", {**pick, "name": "place", "position": [0.1, 0.2, 0.3], "rpy_deg": [180, 0, 0], "note": "on the belt"})
    rig.calls.teach_point("ur5e", {"name": "park", "joints": [0.1, -1, 1, -1, -1, 0]})
    place = points["place"]
    assert (place.frame, place.tool, place.note) == ("table", "gripper", "on the belt")
    assert place.in_frame is not None and place.in_frame.distance(gpac.Pose((0.1, 0.2, 0.3))) < 1e-9
    assert list(points["park"].values()) == [0.1, -1, 1, -1, -1, 0]
    rig.calls.rename_point("ur5e", "home", "begin")
    assert list(points) == ["begin", "pick", "place", "park"], "a point that is renamed keeps its place"
    assert rig.calls.delete_point("ur5e", "pick") == pick
    assert list(points) == ["begin", "place", "park"]


def test_comments_order_and_the_form_of_a_file_stay(rig: Rig, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", rig.arm)
    points["a"] = points["b"] = points["c"] = rig.home
    text = points.path.read_text().replace("b = ", "# beside the press\n b   = ").replace("c = ", "c=")
    points.path.write_text(text + "\n# the end\n")
    rig.calls.teach_point("ur5e", {"name": "d", "joints": [0.5] * 6})
    rig.calls.rename_point("ur5e", "b", "bench 2")
    after = points.path.read_text()
    assert "# beside the press\n" in after and "# the end" in after
    added = "d = { joints = [0.5, 0.5, 0.5, 0.5, 0.5, 0.5] }"
    assert added in after
    assert after.replace(added, "").replace('"bench 2"', "b").split() == (text + "# the end").split()
    assert list(points) == ["a", "bench 2", "c", "d"]


def test_a_file_of_tables_stays_one(rig: Rig, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", rig.arm)
    points["home"] = rig.home
    head = points.path.read_text().split("[points]")[0].replace("format = 2", "format = 1")
    joints = ", ".join(f"{name} = {q}" for name, q in zip(rig.arm.short_names, rig.home, strict=True))
    points.path.write_text(f'{head}[points.home]\nframe = "joints"\njoints = {{{joints}}}\n')
    rig.calls.teach_point("ur5e", {"name": "away", "joints": [0.25] * 6})
    assert "[points.away]" in points.path.read_text()
    assert list(points["away"].values()) == [0.25] * 6
    rig.calls.rename_point("ur5e", "home", "begin")
    assert list(points) == ["begin", "away"]


def test_a_page_and_a_program_that_write_at_once_lose_nothing(rig: Rig, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", rig.arm)
    count = 25

    def of_page() -> None:
        for number in range(count):
            rig.calls.teach_point("ur5e", {"name": f"page {number}", "joints": rig.home})

    page = threading.Thread(target=of_page)
    page.start()
    for number in range(count):
        points[f"program {number}"] = rig.home
    page.join()
    assert {*points} == {f"{who} {number}" for who in ("page", "program") for number in range(count)}
    assert {*rig.page()} == {*points}


def test_without_a_file_of_the_program_points_are_kept_for_the_user(rig: Rig, tmp_path: Path) -> None:
    seen = rig.calls.points("ur5e")
    assert Path(seen["file"]).parent == tmp_path / "data" / "opengpac" / "points"
    assert seen["points"] == []
    rig.calls.teach_point("ur5e", {"name": "home", "joints": rig.home})
    assert list(gpac.Points(seen["file"], rig.arm)["home"].values()) == rig.home


def test_what_cannot_be_is_refused_and_the_file_stays(rig: Rig, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", rig.arm)
    points["home"] = rig.home
    before = points.path.read_text()

    def refused(call: str, *given: Any) -> str:
        with pytest.raises(gpac.Error) as told, gpac.errors.refusals:
            getattr(rig.calls, call)("ur5e", *given)
        assert points.path.read_text() == before
        return told.value.message

    assert "cannot be [0.0]" in refused("teach_point", {"name": "x", "joints": [0.0]})
    assert "the frame 'table', which" in refused("teach_point", {"name": "x", "joints": rig.home, "frame": "table", "position": [0, 0, 0]})
    assert "no valid position in its frame 'world'" in refused("teach_point", {"name": "x", "joints": rig.home, "frame": "world"})
    assert "a point must have a name" in refused("teach_point", {"name": " ", "joints": rig.home})
    assert "there is no point 'hom'" in refused("delete_point", "hom")
    assert "there is no point 'away'" in refused("rename_point", "away", "x")
    points["away"] = rig.home
    before = points.path.read_text()
    assert "there is already a point 'away'" in refused("rename_point", "home", "away")
    before = before.replace("joints = [", "joints = [0.0, ", 2)
    points.path.write_text(before)
    assert "cannot be used" in refused("points")
    before = "[points"
    points.path.write_text(before)
    assert "line 1" in refused("teach_point", {"name": "x", "joints": rig.home})
