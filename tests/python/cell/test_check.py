# SPDX-License-Identifier: Apache-2.0
"""`opengpac check` of a program that uses a cell's services plans the program and leaves nothing behind."""

from __future__ import annotations

from pathlib import Path

import pytest

from opengpac.cli import main

PROGRAM = """
import opengpac as gpac
from opengpac.cell import DigitalInput, DigitalOutput, pulse, set_output, wait_for_input

cell = gpac.System("cell", restore="cell.restart")
fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
io = fast.processor.physical_device("io", gpac.drivers.scripted(
    [{{"name": "gate", "direction": "read", "type": "bool"}}, {{"name": "valve", "direction": "write", "type": "bool"}}]), exchange=fast)
gate, valve = DigitalInput("gate", io["gate"]), DigitalOutput("valve", io["valve"])
arm = gpac.robots.load("two_joint", on=fast)
cell.emergency_stop_input(io["gate"])
for device in (gate, valve, arm):
    device.enable()
points = gpac.Points("points.toml", arm)
points.teach("pick")
set_output({signal}, True)
pulse(valve, width="0.1 s")
wait_for_input(gate, edge="falling", time_limit="1 s")
cell.pause()
cell.resume()
gpac.robots.move(arm, goal=points["pick"])
cell.alarms.define("E1", "one")
cell.alarms.trip("E1")
cell.mode = "manual"
cell.save("cell.restart")
print("through")
"""


def test_a_program_is_checked_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("good.py").write_text(PROGRAM.format(signal="valve"))
    assert main(["check", "good.py"]) == 0, capsys.readouterr().err
    assert "4 verb applications planned, 0 errors" in capsys.readouterr().out
    assert [file.name for file in tmp_path.iterdir() if file.suffix in (".toml", ".restart")] == []


def test_a_wrong_signal_is_found_with_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.py").write_text(PROGRAM.format(signal="gate"))
    assert main(["check", "bad.py"]) == 1
    said = capsys.readouterr().err
    assert "CallError" in said
    assert "DigitalOutput" in said
    assert "bad.py:16" in said
