# SPDX-License-Identifier: Apache-2.0
"""The cell with a PLC: four protocols, one verb, an emergency stop, and a replay of the run from its record."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import cli

PROGRAM = Path(__file__).parents[2] / "examples" / "cell_with_a_plc.py"


@pytest.mark.parametrize("driver", ["mujoco", "ur"])
def test_it_delivers_rejects_stops_recovers_and_is_replayed(programs: Any, tmp_path: Path, driver: str) -> None:
    done = programs.run("cell_with_a_plc", "--driver", driver, "--output", str(tmp_path))
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed
    assert (tmp_path / "cell_with_a_plc.png").stat().st_size > 0
    recorded = gpac.open_recording(tmp_path / "cell_with_a_plc.mcap")
    assert recorded.complete
    # Each part was reported to the PLC once, and the conveyor never jumped.
    told = {name: recorded[f"{name}.value"]["value"].astype(int) for name in ("delivered", "rejected")}
    assert {name: int((values[1:] > values[:-1]).sum()) for name, values in told.items()} == {"delivered": 2, "rejected": 1}
    steps = abs(recorded["belt.reference"]["value"][1:] - recorded["belt.reference"]["value"][:-1])
    assert steps.max() <= 0.5 * 1e-3 * (1 + 1e-9)
    ends = [end["report"]["condition"] for end in recorded.ends if end["report"]["verb"] == "deliver"]
    assert ends == ["was_delivered", "was_rejected", "emergency_stop", "was_delivered"]


def test_it_is_checked_to_its_last_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(PROGRAM), "--output", str(tmp_path)]) == 0, capsys.readouterr().err
    told = capsys.readouterr().out
    assert "0 errors" in told and "not followed" not in told
    assert "Positions and signals are drawn" in told, "it reads back what it would have recorded"
