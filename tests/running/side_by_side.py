# SPDX-License-Identifier: Apache-2.0
"""Runs tests in parallel: `pytest -n 4`. They are collected once, and then the process is forked; a worker that dies is replaced.

The package pytest-xdist starts processes each of which collects all tests itself: here a third of their processor time. Tests marked
`alone` run last, one after the other, so that none waits for another to end.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import time
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from types import SimpleNamespace
from typing import Any

import pytest

from stretches import Stretches
from worker import work

END_S = 30.0
"""Time limit of a worker's cleanup after the run is abandoned."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the option `-n`."""
    # Lower-case short options are reserved for pytest, but pytest-xdist has made this one familiar.
    group = parser.getgroup("side by side")
    group._addoption("-n", "--workers", type=int, default=0, help="number of processes that run tests side by side; 0: this one")


def pytest_configure(config: pytest.Config) -> None:
    """Adds the marker of tests that must run alone."""
    config.addinivalue_line("markers", "alone: no other test runs meanwhile, for this one looks at the whole machine")


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Runs the tests in workers, if any are requested."""
    workers = session.config.option.workers
    if workers < 1 or session.config.option.collectonly or session.testsfailed:
        return None
    if (terminal := session.config.pluginmanager.getplugin("terminalreporter")) is not None:
        terminal.showfspath = False
    session.config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]
    alone = [index for index, item in enumerate(session.items) if item.get_closest_marker("alone")]
    together = [index for index in range(len(session.items)) if index not in set(alone)]
    notes: list[dict[str, Any]] = []
    gc.collect()
    gc.freeze()
    try:
        Pool(session, together, min(workers, len(together)), notes, is_alone=False).run()
        Pool(session, alone, min(1, len(alone)), notes, is_alone=True).run()
    finally:
        gc.unfreeze()
        _write(session, notes)
    return True


def _write(session: pytest.Session, notes: list[dict[str, Any]]) -> None:
    # Duration of each test, read by `tests/closing.py`.
    out = session.config.rootpath / "out"
    out.mkdir(exist_ok=True)
    (out / "tests.jsonl").write_text("".join(json.dumps(note) + "\n" for note in notes))


@dataclass
class Worker:
    """Worker process: its descriptor, its connection, its present test, and the test announced as the next."""

    number: int
    process: int
    descriptor: int
    connection: Connection
    test: int | None = None
    following: int | None = None
    began: float = 0.0


class Pool:
    """Workers that run some of the session's tests."""

    def __init__(self, session: pytest.Session, tests: list[int], workers: int, notes: list[dict[str, Any]], is_alone: bool) -> None:
        self._session = session
        self._stretches = Stretches(tests, max(workers, 1))
        self._workers: list[Worker] = []
        self._count = workers
        self._notes = notes
        self._is_alone = is_alone

    def run(self) -> None:
        """Runs the tests. Raises pytest's exception if the run is abandoned after a failure."""
        try:
            for number in range(self._count):
                self._start(number)
            while self._workers:
                ready = wait([one for worker in self._workers for one in (worker.connection, worker.descriptor)])
                for worker in [worker for worker in self._workers if worker.connection in ready or worker.descriptor in ready]:
                    self._hear(worker)
                if self._session.shouldfail:
                    raise self._session.Failed(self._session.shouldfail)
                if self._session.shouldstop:
                    raise self._session.Interrupted(self._session.shouldstop)
        finally:
            self._give_up()

    def _start(self, number: int) -> None:
        here, there = Pipe()
        process = os.fork()
        if process == 0:
            here.close()
            for other in self._workers:
                other.connection.close()
                os.close(other.descriptor)
            work(self._session, f"w{number}", there)
        there.close()
        worker = Worker(number, process, os.pidfd_open(process), here)
        self._workers.append(worker)
        self._send(worker)

    def _send(self, worker: Worker) -> None:
        worker.test = self._stretches.take(worker.number) if worker.following is None else worker.following
        worker.following = None if worker.test is None else self._stretches.neighbour(worker.number)
        try:
            worker.connection.send(None if worker.test is None else (worker.test, worker.following))
        except BrokenPipeError:
            # The worker has died: its descriptor reports it.
            return

    def _hear(self, worker: Worker) -> None:
        """Takes all messages of a worker; removes one that has ended, and replaces it if its end was unexpected."""
        has_ended = bool(wait([worker.descriptor], 0))
        try:
            while worker.connection.poll():
                self._take(worker, *worker.connection.recv())
        except (EOFError, ConnectionResetError):
            has_ended = True
        if not has_ended:
            return
        self._workers.remove(worker)
        _, status = os.waitpid(worker.process, 0)
        worker.connection.close()
        os.close(worker.descriptor)
        if worker.test is not None:
            self._report_death(worker, worker.test, os.waitstatus_to_exitcode(status))
            if worker.following is not None:
                self._stretches.put_back(worker.number, worker.following)
            self._start(worker.number)

    def _take(self, worker: Worker, hook: str, arguments: dict[str, Any]) -> None:
        config = self._session.config
        if hook == "finished":
            assert worker.test is not None
            name = str(self._session.items[worker.test].nodeid)
            lasted_s = time.monotonic() - worker.began
            self._notes.append({"test": name, "lasted_s": lasted_s, "processor_s": arguments["processor_s"], "alone": self._is_alone})
            self._send(worker)
            return
        if hook == "broken":
            raise RuntimeError(f"worker w{worker.number} failed:\n{arguments['text']}")
        if hook == "pytest_runtest_logstart":
            worker.began = time.monotonic()
        if hook == "pytest_runtest_logreport":
            report = config.hook.pytest_report_from_serializable(config=config, data=arguments["report"])
            # The terminal names the worker by this.
            name = f"w{worker.number}"
            report.node = SimpleNamespace(gateway=SimpleNamespace(id=name), _workerinfocache=f"worker {name}")
            arguments["report"] = report
        if hook == "pytest_warning_recorded":
            config.hook.pytest_warning_recorded.call_historic(kwargs=arguments)
        else:
            getattr(config.hook, hook)(**arguments)

    def _report_death(self, worker: Worker, test: int, status: int) -> None:
        item = self._session.items[test]
        how = f"by {signal.Signals(-status).name}" if status < 0 else f"with status {status}"
        report = pytest.TestReport(
            nodeid=item.nodeid,
            location=item.location,
            keywords={},
            outcome="failed",
            longrepr=f"worker w{worker.number} ended {how} while it ran {item.nodeid}",
            when="call",
        )
        self._session.config.hook.pytest_runtest_logreport(report=report)

    def _give_up(self) -> None:
        """Interrupts the remaining workers, as Ctrl-C does, and kills those that do not end."""
        for worker in self._workers:
            os.kill(worker.process, signal.SIGINT)
        ends = time.monotonic() + END_S
        for worker in self._workers:
            if not wait([worker.descriptor], max(0.0, ends - time.monotonic())):
                os.kill(worker.process, signal.SIGKILL)
            os.waitpid(worker.process, 0)
            worker.connection.close()
            os.close(worker.descriptor)
        self._workers = []
