# SPDX-License-Identifier: Apache-2.0
"""Example programs run as a whole, under the virtual clock, and their traces are compared with the recorded ones.

`pytest tests/examples --renew` records them again; check the difference before you commit it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from opengpac import _native

ROOT = Path(__file__).parent.parent.parent
TRACES = Path(__file__).parent / "traces"


@dataclass(frozen=True)
class Run:
    """Exit code of a program, its output, and its trace."""

    code: int
    printed: str
    trace: str


class Programs:
    """Runner of example programs, and comparison of their traces."""

    def __init__(self, folder: Path, renew: bool) -> None:
        self._folder, self._renew = folder, renew

    def run(self, program: str, *words: str, replay: Path | None = None) -> Run:
        """Runs `examples/PROGRAM.py` under the virtual clock; `replay` is a file from which the run can be replayed."""
        trace = self._folder / "trace.txt"
        options = ("--clock", "virtual", "--output", str(self._folder), "--trace", str(trace), *words)
        by = () if replay is None else ("-m", "opengpac", "record", "-o", str(replay))
        done = self.script(f"examples/{program}.py", *options, by=by)
        return Run(done.code, done.printed, trace.read_text() if trace.exists() else "")

    def script(self, path: str, *words: str, by: tuple[str, ...] = ()) -> Run:
        """Runs a program of the repository with these options, by Python or by the command `by`."""
        paths = [str(Path(_native.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
        command = [sys.executable, *by, str(ROOT / path), *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, env=environment)
        return Run(done.returncode, done.stdout + done.stderr, "")

    def compare(self, name: str, trace: str, within: float) -> None:
        """Compares a trace with `traces/NAME.txt`: equal columns and times, and values equal `within` a tolerance; 0 means bit for bit."""
        kept = TRACES / f"{name}.txt"
        if self._renew:
            kept.write_text(trace)
        expected = kept.read_text()
        assert trace.splitlines()[0] == expected.splitlines()[0], "the columns"
        if within == 0.0:
            assert trace == expected
            return
        now, then = (np.loadtxt(text.splitlines(), skiprows=1) for text in (trace, expected))
        assert now.shape == then.shape
        assert np.array_equal(now[:, 0], then[:, 0]), "the times"
        np.testing.assert_allclose(now, then, rtol=0.0, atol=within)


@pytest.fixture
def programs(tmp_path: Path, request: pytest.FixtureRequest) -> Programs:
    """Returns the runner of the example programs."""
    return Programs(tmp_path, bool(request.config.getoption("--renew")))
