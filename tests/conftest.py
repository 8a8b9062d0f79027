# SPDX-License-Identifier: Apache-2.0
"""Options of the tests; and what lets processes run them side by side (`pytest -n 2`): sockets of its own for each, turns to be alone."""

from __future__ import annotations

import atexit
import datetime
import fcntl
import json
import os
import shutil
import signal
import tempfile
import time
from collections.abc import Generator

import pytest
from hypothesis import HealthCheck, settings

# How long an example takes, and how long it is drawn, is the machine's doing: Hypothesis fails above 200 ms an example if nothing is said.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# A shell starts what runs in its background without Ctrl-C; tests press it.
signal.signal(signal.SIGINT, signal.default_int_handler)

_WORKER = os.environ.get("PYTEST_XDIST_WORKER")
_waited_s = 0.0
"""Time that this process has waited for its turns."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew", action="store_true", help="write expected texts anew, to be read before they are committed")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "alone: no other test runs meanwhile, for this one looks at the whole machine")
    if "OPENGPAC_COMPILED" not in os.environ:
        # Workers inherit it: each block in Python is compiled once for all of them, and nothing of the user's is written.
        os.environ["OPENGPAC_COMPILED"] = compiled = tempfile.mkdtemp(prefix="og-blocks-")
        atexit.register(_remove, compiled, os.getpid())
    if _WORKER:
        # Systems of one name and user find each other there. Short: a socket's path has 107 letters.
        os.environ["XDG_RUNTIME_DIR"] = folder = tempfile.mkdtemp(prefix=f"og-{_WORKER}-")
        atexit.register(_remove, folder, os.getpid())


def _remove(folder: str, owner: int) -> None:
    # Not by a process that a test forked off.
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """A test that is marked `alone` waits until no other runs, and others wait for its end: the one that waits longest is next.

    So are those for whom standing still for half a second is being lost: beside others that would be the machine's doing.
    """
    if not _WORKER:
        return (yield)
    global _waited_s
    place = item.config.rootpath / "out"
    place.mkdir(exist_ok=True)
    asked = time.monotonic()
    with (place / "tests.turn").open("w") as turn, (place / "tests.run").open("w") as run:
        fcntl.flock(turn, fcntl.LOCK_EX)
        fcntl.flock(run, fcntl.LOCK_EX if item.get_closest_marker("alone") else fcntl.LOCK_SH)
        fcntl.flock(turn, fcntl.LOCK_UN)
        _waited_s += time.monotonic() - asked
        try:
            return (yield)
        finally:
            # Not only closed: a process that a test forked off may have it too.
            fcntl.flock(run, fcntl.LOCK_UN)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test that failed says how busy the machine was and which day's seeds it had: without them it can hardly be tried again."""
    report = yield
    if report.failed:
        load = " ".join(f"{average:.1f}" for average in os.getloadavg())
        day = datetime.date.today()
        report.sections.append(("the machine", f"load {load} of {os.cpu_count()} processors; seeds of day {day.toordinal()} ({day})"))
    return report


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Notes how long this process waited for its turns; `tests/closing.py` adds them up."""
    if _WORKER:
        with (session.config.rootpath / "out" / "turns.jsonl").open("a") as out:
            out.write(json.dumps({"worker": _WORKER, "waited_s": _waited_s}) + "\n")
