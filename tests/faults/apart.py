# SPDX-License-Identifier: Apache-2.0
"""Faults with the programming system and the supervisor in separate processes: a daemon, and a program connected to it."""

from __future__ import annotations

import contextlib
import json
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import application
import opengpac as gpac
from leftovers import Before
from plant import LIMIT_S, Plant, until
from rounds import LIMIT, PROCESS, Round, runs_for_a_while, started

VICTIM = Path(__file__).parent / "victim.py"

LEAVES = {"halt": "halted", "safe": "aborted"}
"""End condition of an instance by its policy; with any other policy it continues and does not end."""


class Daemon:
    """`opengpac rts` with a Unix socket in a folder."""

    def __init__(self, folder: str) -> None:
        path = Path(folder) / "cell.sock"
        command = [sys.executable, "-m", "opengpac", "rts", "--name", "campaign", "--socket", str(path)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout
        self.url = self.process.stdout.readline().strip().removeprefix("listening on ")

    def kill(self) -> None:
        """Kills the daemon, as a fault would."""
        self.process.kill()

    def stop(self) -> int:
        """Ends the daemon in order unless it was killed; returns its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
        return self.process.returncode


@contextlib.contextmanager
def daemon() -> Iterator[Daemon]:
    """Yields a daemon, which has ended after the block."""
    with tempfile.TemporaryDirectory() as folder:
        made = Daemon(folder)
        try:
            yield made
        finally:
            made.stop()


def said_counts(victim: subprocess.Popen[str], lines: int) -> list[str]:
    """Reads `lines` lines from a victim; returns a message about the first wrong one, if any."""
    assert victim.stdout
    said = [victim.stdout.readline() for _ in range(lines)]
    return next(([f"the victim said {line!r}"] for line in said if not line.startswith("count ")), [])


def of_the_supervisor(found: Round, before: Before, chosen: random.Random, blocks: str) -> None:
    """kill -9 of a daemon while its client waits or reads values: the client is notified, processors in processes end in order."""
    with daemon() as system:
        plant = Plant()
        cell = gpac.connect(system.url, name="operator", progress=False)
        made = application.run(cell, blocks, "counts", at=0, doomed=PROCESS, plant=plant)
        runs_for_a_while(made, chosen)
        if len(started(before, "run_processor")) != 1:
            found.wrong.append("the doomed processor has no process")
        killed: list[int] = []

        def kill() -> None:
            killed.append(time.monotonic_ns())
            system.kill()

        waits = chosen.random() < 0.5
        watch, fault = plant.watched(), threading.Timer(chosen.uniform(0.0, 0.05), kill)
        fault.start()
        try:
            while not waits:
                _ = made.count.value
            made.healthy.wait(timeout=LIMIT)
            found.wrong.append("the client's wait ended in order")
        except gpac.ConnectionLost as why:
            fault.join()
            found.time_from(killed[0])
            if "was lost" not in str(why) or system.url not in str(why):
                found.wrong.append(f"the client is not told what happened: {why}")
        found.expect_safe(watch, killed[0])
        try:
            cell.svv("another")
            found.wrong.append("a call after the loss was answered")
        except gpac.ConnectionLost:
            pass
        cell.close()


def of_the_programming_system(found: Round, _: Before, chosen: random.Random, blocks: str) -> None:
    """kill -9 of a daemon's client: every verb follows its policy, and the next client of that name collects the end reports."""
    policies = {
        "healthy": "continue",
        "pushing": chosen.choice(["halt", "safe"]),
        "failing": "halt",
        "bystander": chosen.choice(["halt", "continue"]),
    }
    with daemon() as system:
        plant = Plant()
        told = {"blocks": blocks, "doomed": dict(PROCESS), "plant": plant.name, "url": system.url, "policies": policies}
        with (
            subprocess.Popen([sys.executable, str(VICTIM), json.dumps(told)], stdout=subprocess.PIPE, text=True) as victim,
            gpac.connect(system.url, name="watcher", command=False, progress=False) as watcher,
        ):
            found.wrong += said_counts(victim, chosen.randint(1, 40))
            names = {instance.verb: instance.name for instance in watcher.instances}
            watch = plant.watched()
            killed_ns = time.monotonic_ns()
            victim.kill()
            victim.wait()
            until(lambda: not _alive(watcher), "the victim's session is not lost")
        with gpac.connect(system.url, name="victim", progress=False) as cell:
            _collect(found, cell, policies, killed_ns)
            found.expect_safe(watch, killed_ns)
            for verb in (verb for verb, policy in policies.items() if policy == "continue"):
                _take_up(found, cell, names[verb])
        if system.stop() != 0:
            found.wrong.append(f"the daemon ended with status {system.process.returncode}")


def _alive(watcher: gpac.System) -> bool:
    assert watcher.session is not None
    return any(line["alive"] for line in watcher.session.sessions if line["name"] == "victim")


def _collect(found: Round, cell: gpac.System, policies: dict[str, str], killed_ns: int) -> None:
    expected = {verb: LEAVES[policy] for verb, policy in policies.items() if policy in LEAVES}
    ended: dict[str, Any] = {}

    def is_all() -> bool:
        ended.update({report.verb: report.condition for report in cell.kept_reports()})
        return len(ended) >= len(expected)

    assert cell.session is not None
    if not cell.session.returned:
        found.wrong.append("the next client of the name does not return to its session")
    with contextlib.suppress(TimeoutError):
        until(is_all, "not all end reports are kept")
    found.time_from(killed_ns)
    if ended != expected:
        found.wrong.append(f"the end reports are {ended} instead of {expected}")
    if cell.kept_reports():
        found.wrong.append("end reports are collected twice")


def _take_up(found: Round, cell: gpac.System, name: str) -> None:
    instance = cell.instance(name)
    try:
        instance.wait(timeout="10 ms")
        found.wrong.append(f"'{name}' was to continue and has ended")
        return
    except TimeoutError:
        instance.halt()
    if instance.wait(timeout=LIMIT).condition != "halted":
        found.wrong.append(f"'{name}' was not halted")
