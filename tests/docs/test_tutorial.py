# SPDX-License-Identifier: Apache-2.0
"""The notebook of the tutorial runs from its first cell to its last, and contains the outputs that it shows."""

from __future__ import annotations

import faulthandler
import os
import sys
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

import opengpac

NOTEBOOK = Path(__file__).parent.parent.parent / "docs" / "tutorial.ipynb"
CELL_S = 60
"""Time limit of each cell, as of each test: a hang fails it, slowness does not."""


def code(notebook: Any) -> list[Any]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def shown(cell: Any) -> dict[str, str]:
    """Returns the outputs of a cell, by kind."""
    found: dict[str, str] = {}
    for output in cell.outputs:
        found |= output.get("data", {})
    return found


def patience(**_: Any) -> None:
    """Gives each cell the time of a test, within the limit of the watchdog over tests."""
    faulthandler.dump_traceback_later(CELL_S + 10, exit=True, file=sys.__stderr__)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Returns the notebook after it has run, in a folder of its own."""
    folder = tmp_path_factory.mktemp("tutorial")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([str(Path(opengpac.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]))
        patch.setenv("IPYTHONDIR", str(folder))
        patch.setenv("JUPYTER_RUNTIME_DIR", str(folder))
        notebook = nbformat.read(NOTEBOOK, as_version=4)
        where = {"metadata": {"path": str(folder)}}
        client = NotebookClient(notebook, kernel_name="python3", timeout=CELL_S, startup_timeout=CELL_S, resources=where)
        client.on_cell_start = patience
        return client.execute()


def test_the_repository_has_it_without_outputs() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    assert [cell.source[:30] for cell in code(notebook) if cell.outputs or cell.execution_count] == []


def test_it_runs_and_shows_pictures_plots_and_tables(run: Any) -> None:
    by_source = {cell.source: shown(cell) for cell in code(run)}
    drive = next(data for source, data in by_source.items() if source.endswith("\ndrive"))
    assert "image/svg+xml" in drive and "pid" in drive["image/svg+xml"]
    assert sum("image/png" in data for data in by_source.values()) == 3
    assert "<table" in by_source["lib.lowpass"]["text/html"]
    swing = next(data for source, data in by_source.items() if source.endswith("\nswing"))
    assert "<svg" in swing["text/html"]


def test_what_it_says_is_so(run: Any) -> None:
    by_source = {cell.source: shown(cell).get("text/plain", "") for cell in code(run)}
    overshoot = eval(next(text for source, text in by_source.items() if source.endswith("\novershoot")))
    calm, fast, tuned = overshoot.values()
    assert calm < 15 < fast and tuned < fast / 2, overshoot
    end = next(text for source, text in by_source.items() if source.endswith("\nend"))
    assert "reached after" in end and "sensed=0.2" in end
    report = next(text for source, text in by_source.items() if source.endswith("\nreport"))
    assert "arrived" in report
    times = next(text for source, text in by_source.items() if source.count("block_times") == 2)
    assert "drive.pid" in times and "drive.axis" in times
    recorded = eval(next(text for source, text in by_source.items() if source.startswith("with cell.record(")))
    assert (recorded[0]["position"], recorded[1], recorded[2]) == (5_001, {}, 1.0), "every value of 5 s at 1 kHz, and the one before"
