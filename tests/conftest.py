# SPDX-License-Identifier: Apache-2.0
"""Options of the tests, and the common environment of their processes."""

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

# The time to generate and run an example depends on the machine's load; by default Hypothesis fails above 200 ms.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# A shell starts background jobs with SIGINT ignored; tests send it.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew", action="store_true", help="rewrite the expected texts, to be reviewed before they are committed")


def pytest_configure(config: pytest.Config) -> None:
    if "OPENGPAC_COMPILED" not in os.environ:
        # Inherited by the workers: each block in Python is compiled only once for all of them, and nothing is written to the user's
        # cache.
        os.environ["OPENGPAC_COMPILED"] = compiled = tempfile.mkdtemp(prefix="og-blocks-")
        atexit.register(_remove, compiled, os.getpid())


def _remove(folder: str, owner: int) -> None:
    # A process forked by a test must not delete it.
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds the machine's load and the day's seeds to the report of a failed test: without them it can hardly be reproduced."""
    report = yield
    if report.failed:
        load = " ".join(f"{average:.1f}" for average in os.getloadavg())
        day = datetime.date.today()
        report.sections.append(("the machine", f"load {load} of {os.cpu_count()} processors; seeds of day {day.toordinal()} ({day})"))
    return report
