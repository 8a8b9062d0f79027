# SPDX-License-Identifier: Apache-2.0
"""Options of the tests, and what their processes have in common."""

from __future__ import annotations

import atexit
import datetime
import os
import shutil
import signal
import tempfile
from collections.abc import Generator

import pytest
from hypothesis import HealthCheck, settings

# How long an example takes, and how long it is drawn, is the machine's doing: Hypothesis fails above 200 ms an example if nothing is said.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# A shell starts what runs in its background without Ctrl-C; tests press it.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew", action="store_true", help="write expected texts anew, to be read before they are committed")


def pytest_configure(config: pytest.Config) -> None:
    if "OPENGPAC_COMPILED" not in os.environ:
        # Workers inherit it: each block in Python is compiled once for all of them, and nothing of the user's is written.
        os.environ["OPENGPAC_COMPILED"] = compiled = tempfile.mkdtemp(prefix="og-blocks-")
        atexit.register(_remove, compiled, os.getpid())


def _remove(folder: str, owner: int) -> None:
    # Not by a process that a test forked off.
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test that failed says how busy the machine was and which day's seeds it had: without them it can hardly be tried again."""
    report = yield
    if report.failed:
        load = " ".join(f"{average:.1f}" for average in os.getloadavg())
        day = datetime.date.today()
        report.sections.append(("the machine", f"load {load} of {os.cpu_count()} processors; seeds of day {day.toordinal()} ({day})"))
    return report
