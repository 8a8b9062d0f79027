# SPDX-License-Identifier: Apache-2.0
"""A worker of `side_by_side`: a process that is forked after the collection and runs the tests sent to it."""

from __future__ import annotations

import atexit
import contextlib
import os
import resource
import shutil
import signal
import tempfile
import traceback
import warnings
from multiprocessing.connection import Connection
from typing import Any, NoReturn

import pytest

SILENT = ("terminalreporter", "terminalprogress")
"""Plugins that print; only the first process prints."""


class Reporter:
    """Plugin that sends pytest's reports to the first process, as the hook's name and arguments."""

    def __init__(self, config: pytest.Config, connection: Connection) -> None:
        self._config = config
        self._connection = connection

    def send(self, hook: str, **arguments: Any) -> None:
        """Sends one call of a hook."""
        self._connection.send((hook, arguments))

    def pytest_runtest_logstart(self, nodeid: str, location: Any) -> None:
        """Sends the beginning of a test."""
        self.send("pytest_runtest_logstart", nodeid=str(nodeid), location=location)

    def pytest_runtest_logfinish(self, nodeid: str, location: Any) -> None:
        """Sends the end of a test."""
        self.send("pytest_runtest_logfinish", nodeid=str(nodeid), location=location)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Sends a report in the form that pytest has for other processes."""
        self.send("pytest_runtest_logreport", report=self._config.hook.pytest_report_to_serializable(config=self._config, report=report))

    def pytest_warning_recorded(self, warning_message: warnings.WarningMessage, when: str, nodeid: str, location: Any) -> None:
        """Sends a warning as its text."""
        said = warnings.WarningMessage(str(warning_message.message), UserWarning, warning_message.filename, warning_message.lineno)
        self.send("pytest_warning_recorded", warning_message=said, when=when, nodeid=str(nodeid), location=location)


def processor_s() -> float:
    """Returns the processor time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def work(session: pytest.Session, name: str, connection: Connection) -> NoReturn:
    """Runs tests until `None` arrives, and ends the process."""
    reporter = Reporter(session.config, connection)
    folder = tempfile.mkdtemp(prefix=f"og-{name}-")
    try:
        _settle(session.config, name, folder)
        session.config.pluginmanager.register(reporter)
        _run(session, connection)
    except (KeyboardInterrupt, EOFError, BrokenPipeError):
        pass
    except BaseException:
        with contextlib.suppress(OSError):
            connection.send(("broken", {"text": traceback.format_exc()}))
    finally:
        with contextlib.suppress(BaseException):
            session._setupstate.teardown_exact(None)
        with contextlib.suppress(BaseException):
            atexit._run_exitfuncs()
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(0)


def _run(session: pytest.Session, connection: Connection) -> None:
    # A test is told which one follows: fixtures common to both stay set up.
    while (sent := connection.recv()) is not None:
        test, following = sent
        before_s = processor_s()
        next_item = None if following is None else session.items[following]
        session.config.hook.pytest_runtest_protocol(item=session.items[test], nextitem=next_item)
        connection.send(("finished", {"processor_s": processor_s() - before_s}))


def _settle(config: pytest.Config, name: str, folder: str) -> None:
    """Gives this process its own terminal, folders and exit functions."""
    # The exit functions of the first process remove resources that all workers use.
    atexit._clear()
    # A shell starts background jobs with SIGINT ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for silent in SILENT:
        if (plugin := config.pluginmanager.getplugin(silent)) is not None:
            config.pluginmanager.unregister(plugin)
    # Files of captured output, and thus their positions, would be shared with the first process.
    capture = config.pluginmanager.getplugin("capturemanager")
    capture.stop_global_capturing()
    capture.start_global_capturing()
    capture.suspend_global_capture()
    factory: Any = config._tmp_path_factory  # type: ignore[attr-defined]
    factory._basetemp = factory.getbasetemp() / name
    factory._basetemp.mkdir(mode=0o700, exist_ok=True)
    os.environ["PYTEST_WORKER"] = name
    # Systems of the same name and user find each other in this folder. The path is short: a socket's path has at most 107 characters.
    os.environ["XDG_RUNTIME_DIR"] = folder
