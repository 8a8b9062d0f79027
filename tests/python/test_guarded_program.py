# SPDX-License-Identifier: Apache-2.0
"""Processors that are threads of the program: the program itself is guarded, and a plant may have its own watchdog."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import children, until
from opengpac import _native, activate
from opengpac import library as lib

pytestmark = pytest.mark.alone

FAULTS = Path(__file__).parent.parent / "faults"

STANDSTILL_S = 2.2
"""Standstill longer than the 2 s permitted for a timer."""

SHORT = "300 ms"
SHORT_S = 0.6
"""Standstill longer than the shorter bound, and than the 0.5 s from which a standstill is reported."""


def tree(pid: int) -> list[int]:
    """Returns a process and all its descendants; guards last."""
    found, guards = [pid], children("run_guard", pid)
    for entry in ("run_processor", "run_plant"):
        for child in children(entry, pid):
            found += tree(child)
    return [each for each in found if each not in guards] + guards


def held(guard: int) -> list[str]:
    """Returns the descriptors of processes and memory that a guard holds, by kind; empty if it has ended."""
    found = []
    with contextlib.suppress(OSError):
        for descriptor in (Path("/proc") / str(guard) / "fd").iterdir():
            found.append(os.readlink(descriptor))
    return sorted(kind for kind in found if "pidfd" in kind or "memfd" in kind)


class Program:
    """Separate program that pushes a plant by a thread."""

    def __init__(self, plant: str, timeout: str | None = None, *, process: bool = False, lost_after: str | None = None) -> None:
        self.plant = plant
        words = {"plant": plant, "process": process, "timeout": timeout, "lost_after": lost_after}
        command = [sys.executable, str(FAULTS / "watched_program.py"), json.dumps(words)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout and self.process.stdout.readline() == "ready\n"

    def ask(self, what: str) -> str:
        """Sends a request; returns the program's answer."""
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(f"{what}\n")
        self.process.stdin.flush()
        return self.process.stdout.readline()

    def is_safe(self) -> bool:
        """Returns whether the plant obeys its safe commands by order of a party other than its driver."""
        state = json.loads(_native.plant_state(self.plant) or "{}")
        return bool(state.get("is_safe"))

    def is_stopped_and_goes_on(self) -> list[str]:
        """Stops the program until the plant is safe, lets it continue, and returns the condition with which its push ended."""
        self.process.send_signal(signal.SIGSTOP)
        until(self.is_safe, "the plant is safe")
        self.process.send_signal(signal.SIGCONT)
        return json.loads(self.ask("end"))

    def stands_still_with_all(self, seconds: float) -> None:
        """Stops the program with all its descendants for `seconds`, and lets them continue."""
        every = tree(self.process.pid)
        for process in every:
            os.kill(process, signal.SIGSTOP)
        stopped = time.monotonic()
        until(lambda: time.monotonic() - stopped > seconds, "they stood still")
        for process in every:
            os.kill(process, signal.SIGCONT)

    def stops_with(self, given: list[str], gone: list[int]) -> bool:
        """Stops the program; returns whether a guard not in `gone` holds these descriptors. If none does, lets the program continue."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED)
        if given in [held(guard) for guard in children("run_guard", self.process.pid) if guard not in gone]:
            return True
        self.process.send_signal(signal.SIGCONT)
        return False

    def refused(self, what: str) -> str:
        """Returns the reason for a refusal."""
        return json.loads(self.ask(what))

    def end(self) -> None:
        """Ends the program, whatever its state."""
        self.process.send_signal(signal.SIGCONT)
        self.process.communicate("close\n", timeout=120)


@pytest.fixture
def program(request: pytest.FixtureRequest) -> Iterator[Program]:
    made = Program(f"test-guarded-{os.getpid()}", getattr(request, "param", None))
    yield made
    made.end()


def test_a_program_that_is_killed_leaves_its_plant_safe(program: Program) -> None:
    assert not program.is_safe()
    program.process.kill()
    until(program.is_safe, "the plant is safe")


def test_a_program_that_is_stopped_is_spared_and_told(program: Program) -> None:
    guards = children("run_guard", program.process.pid)
    assert len(guards) == 2
    for _ in range(2):
        condition, why = program.is_stopped_and_goes_on()
        assert condition == "device_lost" and "its process hung, so the guard brought the plant to its safe state" in why
        assert (program.ask("reset"), program.ask("push")) == ("reset\n", "pushed\n")
        assert not program.is_safe() and program.ask("look") == "[]\n"
    assert children("run_guard", program.process.pid) == guards


def test_what_was_commanded_is_safe_when_all_who_watch_stood_still_together(program: Program) -> None:
    every = [program.process.pid, *children("run_guard", program.process.pid)]
    for process in every:
        os.kill(process, signal.SIGSTOP)
    stopped = time.monotonic()
    until(lambda: time.monotonic() - stopped > STANDSTILL_S, "they stood still for longer than a timer may")
    for process in every:
        os.kill(process, signal.SIGCONT)
    condition, why = json.loads(program.ask("end"))
    assert condition == "device_lost" and "its source 'rtp1.fast' was suspended for " in why and "they are in their safe states now" in why
    assert (program.ask("reset"), program.ask("push"), program.ask("look")) == ("reset\n", "pushed\n", "[]\n")


@pytest.mark.parametrize("process", [False, True])
def test_a_standstill_of_all_is_told_with_its_length_and_nobody_is_blamed(process: bool) -> None:
    """Like a paused virtual machine or a frozen container, program, processor, plant and guards stop at once."""
    program = Program(f"test-together-{os.getpid()}-{process}", process=process, lost_after=SHORT)
    try:
        for _ in range(2):
            there = tree(program.process.pid)
            program.stands_still_with_all(SHORT_S)
            condition, why = json.loads(program.ask("end"))
            assert (
                condition == "device_lost"
                and "its source 'rtp1.fast' was suspended for " in why
                and "they are in their safe states now" in why
            )
            alarms, late = json.loads(program.ask("told"))
            assert sorted(alarms) == ["device_lost drive", "time_lost system"], "and no processor or guard is lost"
            words = r"source '[a-z0-9.]+' was suspended for \d+\.\d s \(its process or the machine was stopped\)"
            assert re.search(words, alarms["time_lost system"])
            assert any(text.startswith("source 'rtp1.fast' was suspended for ") for text in late)
            until(lambda there=there: tree(program.process.pid) == there, "nobody was ended, and who stood in for a guard is gone")
            assert (program.ask("reset"), program.ask("push"), program.ask("look")) == ("reset\n", "pushed\n", "[]\n")
    finally:
        program.end()


@pytest.mark.parametrize("process", [False, True])
def test_a_shorter_standstill_of_all_loses_nothing_and_is_in_the_log(process: bool) -> None:
    program = Program(f"test-together-{os.getpid()}-{process}", process=process, lost_after="60 s")
    try:
        there = tree(program.process.pid)
        program.stands_still_with_all(2 * SHORT_S)
        assert program.ask("look") == "[]\n" and not program.is_safe(), "it pushes on"
        alarms, late = json.loads(program.ask("told"))
        assert alarms == {} and any(text.startswith("source 'rtp1.fast' was suspended for ") for text in late)
        until(lambda: tree(program.process.pid) == there, "nobody was ended")
    finally:
        program.end()


@pytest.mark.parametrize("program", ["50 ms"], indirect=True)
def test_a_plant_that_nobody_commands_makes_itself_safe_and_says_so(program: Program) -> None:
    for guard in children("run_guard", program.process.pid):
        os.kill(guard, signal.SIGSTOP)
    condition, why = program.is_stopped_and_goes_on()
    assert condition == "device_lost" and "no command arrived within its timeout of 50 ms" in why
    assert (program.ask("reset"), program.ask("push"), program.ask("look")) == ("reset\n", "pushed\n", "[]\n")


def test_a_guard_of_a_program_that_stands_still_is_replaced(program: Program) -> None:
    gone = children("run_guard", program.process.pid)
    given = held(gone[0])
    assert given and given == held(gone[1])
    for guard in gone:
        os.kill(guard, signal.SIGSTOP)
    # A guard that has been started and is reported as guarding may not have received all that it guards yet.
    until(lambda: given in [held(other) for other in children("run_guard", program.process.pid) if other not in gone], "another one guards")
    assert program.ask("look") == "[]\n"
    # A stopped program replaces no guard, and on a busy machine it might just be replacing one again.
    until(lambda: program.stops_with(given, gone), "it is guarded")
    program.process.kill()
    until(program.is_safe, "the plant is safe")


@pytest.mark.parametrize("lost", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_loses_a_guard_is_guarded_all_the_time(program: Program, lost: signal.Signals) -> None:
    os.kill(children("run_guard", program.process.pid)[0], lost)
    program.process.kill()
    until(program.is_safe, "the plant is safe")


LOST = {
    "gives_up_rights": "the operating system has ended the thread of source 'rtp1.fast'",
    "masks_signals": "a block on source 'rtp1.fast' does not return and has masked every signal",
}


@pytest.mark.parametrize(("block", "why"), LOST.items(), ids=list(LOST))
def test_a_thread_that_is_lost_leaves_its_devices_safe_and_is_told(program: Program, block: str, why: str) -> None:
    assert not program.is_safe() and program.ask(f"lose {block}") == "lost\n"
    condition, told = json.loads(program.ask("end"))
    assert condition == "processor_lost" and why in told and told.endswith("; outputs were made safe: 'drive'"), told
    assert program.is_safe()
    assert program.ask("reset") == "reset\n"
    assert "is lost; see the log for the reason, then start the program again" in program.refused("push")


def test_under_the_virtual_clock_nobody_is_guarded() -> None:
    with gpac.System("virtual", clock="virtual") as cell:
        cell.processor("slow", lost_after="10 s")
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="2 ms", priority=80)
        rtp.physical_device("drives", gpac.drivers.plant_process(gpac.drivers.loopback("x"), timeout="50 ms"), exchange=fast)
        assert not children("run_guard")


@pytest.mark.parametrize(
    "driver", [gpac.drivers.loopback("x", timeout="10 ms"), gpac.drivers.plant_process(gpac.drivers.loopback("x"), timeout="10 ms")]
)
def test_a_source_that_is_too_slow_for_a_watchdog_is_refused(driver: gpac.drivers.Driver) -> None:
    with gpac.System("virtual", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        slow, fast, called = (rtp.timer("slow", period="6 ms"), rtp.timer("fast", period="5 ms"), rtp.software("called"))
        with pytest.raises(
            gpac.PlacementError,
            match=r"device 'd' goes to its safe state after 10 ms without a command, but source 'rtp0\.slow' commands it every 6 ms",
        ):
            rtp.physical_device("d", driver, exchange=slow)
        with pytest.raises(gpac.PlacementError, match=r"source 'rtp0\.called' is not a timer"):
            rtp.physical_device("d", driver, exchange=called)
        rtp.physical_device("d", driver, exchange=fast)


def test_a_timeout_is_over_where_the_source_stopped_commanding() -> None:
    with gpac.System("virtual", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="2 ms", priority=80)
        device = rtp.physical_device("d", gpac.drivers.loopback("x", timeout="10 ms"), exchange=fast)
        push = gpac.Verb("push", blocks={"push": lib.block("write_channel")}, instantiation_parameters={"effort": "push.channel"},
                         input_parameters={"u": "push.u"}, modes={"push.u": "asynchronous"},
                         command_lists={"start": [activate("push", every="2 ms")]})  # fmt: skip
        pushed: Any = push.on(fast).asynch(device["x"].effort, u=1.0)
        cell.advance("1 s")
        assert not pushed.done, "a source that keeps its period keeps the device"
