# SPDX-License-Identifier: Apache-2.0
"""Every example program runs unchanged on a real-time system in another process; `OPENGPAC_SYSTEM` is its address."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from daemons import Daemon
from test_programs import WITHIN

PROGRAMS = {**WITHIN, "centering_grasp": 1e-4}
OPTIONS = {"centering_grasp": ("--offset", "-12")}


@pytest.fixture
def daemon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Daemon]:
    """Yields a daemon with the virtual clock, on which every program of this test runs."""
    made = Daemon(tmp_path)
    monkeypatch.setenv("OPENGPAC_SYSTEM", made.url)
    yield made
    made.stop()


@pytest.mark.usefixtures("daemon")
@pytest.mark.parametrize("program", PROGRAMS)
def test_a_program_gives_the_same_trace_on_a_daemon(programs: Any, program: str) -> None:
    done = programs.run(program, *OPTIONS.get(program, ()))
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed
    programs.compare(program, done.trace, PROGRAMS[program])


@pytest.mark.usefixtures("daemon")
def test_a_program_runs_again_on_the_same_daemon(programs: Any) -> None:
    for _ in range(2):
        done = programs.run("distributed_servo")
        assert done.code == 0, done.printed


@pytest.mark.usefixtures("daemon")
def test_the_program_of_three_levels(programs: Any) -> None:
    printed = programs.script("examples/levels/program.py").printed
    assert "pressed to 0.1100 m" in printed, printed


def test_a_clock_that_does_not_fit_is_refused(programs: Any, daemon: Daemon) -> None:
    done = programs.script("examples/distributed_servo.py")
    assert done.code == 1
    assert f"needs the monotonic clock, but the one at {daemon.url}, which OPENGPAC_SYSTEM names, has the virtual clock" in done.printed
