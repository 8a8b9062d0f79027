# SPDX-License-Identifier: Apache-2.0
"""A programming system that dies during a motion: the policy of its verb is followed, its report is kept, and it can reconnect."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import opengpac as gpac
import swing
from afar import until
from daemons import PATIENCE_S, Daemon, environment

PROGRAM = Path(__file__).with_name("operator_program.py")
KILLS = 20


class Operator:
    """Programming system in a process of its own, with a motion in progress; `instance` is the motion's name."""

    def __init__(self, url: str, *words: str) -> None:
        paths = environment()["PYTHONPATH"] + ":" + str(PROGRAM.parent.parent)
        self.process = subprocess.Popen(
            [sys.executable, str(PROGRAM), url, *words], env=environment(PYTHONPATH=paths), stdout=subprocess.PIPE, text=True
        )
        self.instance = self.line().removeprefix("started ")

    def line(self) -> str:
        """Returns the next line of output."""
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def end(self, how: signal.Signals) -> int:
        """Ends the process; returns its exit code."""
        self.process.send_signal(how)
        self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode


@pytest.fixture
def watcher(real_daemon: Daemon) -> Iterator[gpac.System]:
    """Yields a session that watches."""
    with gpac.connect(real_daemon.url, name="watcher", command=False) as cell:
        yield cell


@pytest.fixture
def operator(real_daemon: Daemon) -> Iterator[Callable[..., Operator]]:
    """Yields a function that starts programming systems; ends all of them."""
    made: list[Operator] = []

    def start(*words: str) -> Operator:
        made.append(Operator(real_daemon.url, *words))
        return made[-1]

    yield start
    for one in made:
        if one.process.poll() is None:
            one.end(signal.SIGKILL)


def alive(watcher: gpac.System, name: str) -> bool:
    assert watcher.session is not None
    return any(line["alive"] for line in watcher.session.sessions if line["name"] == name)


def test_killed_in_the_middle_of_a_motion_it_is_halted_and_its_report_kept(operator: Callable[..., Operator], watcher: gpac.System) -> None:
    """Kills one program after another in one system, each at a random time."""
    for number in range(KILLS):
        kill_and_look(operator, watcher, number)


def kill_and_look(operator: Callable[..., Operator], watcher: gpac.System, number: int) -> None:
    victim = operator("victim", "halt")
    for _ in range(random.Random(number).randrange(60)):
        victim.line()
    assert victim.end(signal.SIGKILL) == -signal.SIGKILL
    until(lambda: not alive(watcher, "victim"), "the session is cut off")
    until(lambda: all(i.device for i in watcher.instances), "the motion ends")
    assert watcher.device("axis").state == "standstill", "the servo goes on and holds the joint"
    assert watcher.session is not None
    with gpac.connect(watcher.session.url, name="victim") as cell:
        assert cell.session is not None and cell.session.returned
        [report] = cell.kept_reports()
        assert (report.verb, report.condition, report.instance) == ("swing_halt", "halted", victim.instance)
        assert cell.kept_reports() == []
        assert cell.device("axis", swing.Joint).state == "standstill"


def test_a_motion_that_is_to_go_on_goes_on_and_is_taken_up(operator: Callable[..., Operator], watcher: gpac.System) -> None:
    victim = operator("victim", "continue")
    assert victim.end(signal.SIGKILL) == -signal.SIGKILL
    until(lambda: not alive(watcher, "victim"), "the session is cut off")
    assert watcher.instance(victim.instance).state == "running"
    assert watcher.session is not None
    with gpac.connect(watcher.session.url, name="victim") as cell:
        instance = cell.instance(victim.instance)
        with pytest.raises(TimeoutError):
            instance.wait("10 ms")
        instance.halt()
        report = instance.wait()
        assert report.condition == "halted"
        assert cell.device("axis").state == "standstill"


def test_a_motion_that_is_to_be_safe_ends_at_once(operator: Callable[..., Operator], watcher: gpac.System) -> None:
    victim = operator("victim", "safe")
    assert victim.end(signal.SIGKILL) == -signal.SIGKILL
    until(lambda: all(i.device for i in watcher.instances), "the motion ends")
    assert watcher.session is not None
    with gpac.connect(watcher.session.url, name="victim") as cell:
        ended = {report.verb: report.condition for report in cell.kept_reports()}
        assert ended == {"swing_safe": "aborted", "robot_joint_servo": "aborted"}, "who drives an output that is to be safe ends too"
        assert cell.device("axis").state == "disabled"


@pytest.mark.parametrize("does", ["looks", "waits"])
def test_an_interrupt_ends_the_program_and_what_it_started(operator: Callable[..., Operator], watcher: gpac.System, does: str) -> None:
    victim = operator("victim", "halt", does)
    assert victim.end(signal.SIGINT) == -signal.SIGINT
    until(lambda: all(i.device for i in watcher.instances), "the motion ends")
    assert not alive(watcher, "victim")
