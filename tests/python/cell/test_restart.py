# SPDX-License-Identifier: Apache-2.0
"""Warm restart: gains, offsets and alarms survive, motion never does."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.robots import move
from opengpac.storage import files


class Axis(gpac.LogicalDevice):
    """Axis without a verb, with some members that are kept and others that are not."""

    offset: gpac.SVV[float] = gpac.svv(unit="rad", keep=True)
    sensed: gpac.SVV[float] = gpac.svv(unit="rad")
    gain = gpac.parameter(1.0, tunable=True)
    reference = gpac.parameter(2.0, keep=True)
    secret = gpac.parameter(3.0, tunable=True, keep=False)
    plain = gpac.parameter(4.0)


def test_gains_offsets_and_alarms_survive(tmp_path: Path) -> None:
    path = tmp_path / "cell.restart"
    with gpac.System("first", clock="virtual", restore=path) as cell:
        bench = Bench(cell)
        axis = Axis("axis", system=cell)
        axis.offset, axis.sensed = 0.125, 0.5
        axis.gain, axis.reference, axis.secret, axis.plain = 10.0, 20.0, 30.0, 40.0
        bench.arm.x.kp = 42.0
        cell.alarms.define("E1", "one")
        cell.alarms.trip("E1")
        cell.alarms.acknowledge()
        cell.alarms.clear("E1")
        cell.alarms.trip("E1")
        bench.arm.enable()
        moving = move.asynch(bench.arm, goal=[1.0, 1.0])
        cell.advance("50 ms")
        cell.save(path)
        assert moving.state == "running"
    with gpac.System("second", clock="virtual", restore=path) as cell:
        bench = Bench(cell)
        axis = Axis("axis", system=cell, gain=7.0)
        assert (axis.offset.value, axis.sensed.value) == (0.125, 0.0)
        assert (axis.gain, axis.reference, axis.secret, axis.plain) == (10.0, 20.0, 3.0, 4.0)
        assert bench.arm.x.kp == 42.0, "what was tuned counts, not what the program says at first"
        assert bench.arm.y.kp == 50.0
        assert [joint.state for joint in bench.arm] == ["disabled", "disabled"]
        assert cell._running() == []
        assert [(a.code, a.number, a.state) for a in cell.alarms.history] == [("E1", 1, "over"), ("E1", 2, "returned")]
        cell.alarms.define("E1", "one")
        cell.alarms.trip("E1")
        assert cell.alarms["E1"].number == 3
        assert cell.left_over == []
        bench.arm.enable()
        assert move(bench.arm, goal=[0.1, 0.1]).condition == "arrived"


def test_devices_that_are_not_made_again_are_not_forgotten(tmp_path: Path) -> None:
    path = tmp_path / "cell.restart"
    with gpac.System("first", clock="virtual") as cell:
        Axis("axis", system=cell).gain = 5.0
        cell.save(path)
    with gpac.System("second", clock="virtual", restore=path) as cell:
        cell.save(path)
    with gpac.System("third", clock="virtual", restore=path) as cell:
        assert Axis("axis", system=cell).gain == 5.0


def test_what_does_not_fit_any_more_is_said(tmp_path: Path) -> None:
    path = tmp_path / "cell.restart"
    with gpac.System("first", clock="virtual") as cell:
        Axis("axis", system=cell).gain = 5.0
        Axis("other", system=cell).gain = 6.0
        cell.save(path)

    class Plainer(gpac.LogicalDevice, name="Axis"):
        """Same type with fewer members."""

        gain = gpac.parameter(1.0, tunable=True)

    class Other(gpac.LogicalDevice):
        """Unrelated type."""

    with gpac.System("second", clock="virtual", restore=path) as cell:
        assert Plainer("axis", system=cell).gain == 5.0
        Other("other", system=cell)
        assert len(cell.left_over) == 3
        assert any("axis.reference" in line for line in cell.left_over)
        assert "'other' was a Axis, but is now a Other" in cell.left_over


def test_a_first_start_has_nothing_to_restore(tmp_path: Path) -> None:
    with gpac.System("first", clock="virtual", restore=tmp_path / "none") as cell:
        assert cell.alarms.history == []


@pytest.mark.parametrize("cut", [0, 1, 40, -3])
def test_a_damaged_file_is_refused_and_names_the_one_before(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "cell.restart"
    with gpac.System("first", clock="virtual") as cell:
        axis = Axis("axis", system=cell)
        axis.gain = 5.0
        cell.save(path)
        axis.gain = 6.0
        cell.save(path)
    whole = path.read_text()
    path.write_text(whole[:cut] if cut else whole.replace("6.0", "9.0"))
    damaged = path.read_text()
    with pytest.raises(gpac.FileFailed, match=r"damaged.*cell\.restart\.previous"):
        gpac.System("second", clock="virtual", restore=path)
    assert path.read_text() == damaged
    with gpac.System("second", clock="virtual", restore=f"{path}.previous") as cell:
        assert Axis("axis", system=cell).gain == 5.0


def test_a_newer_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cell.restart"
    path.write_text(json.dumps({"format": 2, "checksum": "", "content": {}}))
    with pytest.raises(gpac.FileFailed, match="format 2"):
        gpac.System("second", clock="virtual", restore=path)


def test_a_full_disk_leaves_both_files_as_they_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "cell.restart"
    with gpac.System("first", clock="virtual") as cell:
        axis = Axis("axis", system=cell)
        cell.save(path)
        cell.save(path)
        before = {file.name: file.read_text() for file in tmp_path.iterdir()}
        axis.gain = 7.0
        calls = iter(range(10))

        def full_at_the_end(source: Path, to: Path) -> None:
            if next(calls) == 1:
                raise OSError(28, os.strerror(28))
            os.rename(source, to)

        with monkeypatch.context() as disk:
            disk.setattr(files.os, "replace", full_at_the_end)
            with pytest.raises(gpac.FileFailed, match="no space left"):
                cell.save(path)
        assert path.read_text() == before["cell.restart"]
        assert not [file.name for file in tmp_path.iterdir() if file.name.endswith(".new")]


def test_wrong_paths_are_refused(tmp_path: Path) -> None:
    with gpac.System("first", clock="virtual") as cell:
        with pytest.raises(gpac.CallError):
            cell.save(7)  # type: ignore[arg-type]
        with pytest.raises(gpac.FileFailed):
            cell.save(tmp_path / "missing" / "cell.restart")
    with pytest.raises(gpac.CallError):
        gpac.System("second", clock="virtual", restore=7)  # type: ignore[arg-type]
    with pytest.raises(gpac.FileFailed, match="directory"):
        gpac.System("second", clock="virtual", restore=tmp_path)
    gpac.System("second", clock="virtual").close()
