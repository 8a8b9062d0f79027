# SPDX-License-Identifier: Apache-2.0
"""The kinds of faults of a campaign: what each breaks, and what must hold after it."""

from __future__ import annotations

import contextlib
import gc
import json
import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import application
import opengpac as gpac
from leftovers import Before, command_of

VICTIM = Path(__file__).parent / "victim.py"
THREAD: Mapping[str, Any] = {}
PROCESS: Mapping[str, Any] = {"process": True}
"""What the doomed processor is."""

LIMIT = "20 s"
"""How long an end report may take; a net, not a measure."""


@dataclass
class Round:
    """What one fault led to."""

    wrong: list[str] = field(default_factory=list)
    """What did not hold, in words."""
    reported_s: float | None = None
    """From the fault to its end reports, s."""
    safe_s: float | None = None
    """From the fault to the safe outputs, s; None where no plant outlives the fault and could tell."""


@dataclass(frozen=True)
class Kind:
    """A kind of fault: how often the whole campaign makes it, and how often the tests do."""

    name: str
    full: int
    bounded: int
    make: Callable[[random.Random, str], Round]


def accounted(broken: Callable[[Round, Before, random.Random, str], None]) -> Callable[[random.Random, str], Round]:
    """A round of a fault, with what it left behind once the system is closed and nobody holds it any more."""

    def make(chosen: random.Random, blocks: str) -> Round:
        found, before = Round(), Before()
        broken(found, before, chosen, blocks)
        gc.collect()
        found.wrong += before.left_over()
        return found

    return make


def in_a_block(block: str, doomed: Mapping[str, Any] = THREAD) -> Callable[[random.Random, str], Round]:
    """A signal or an endless loop inside a block: `fault` for the verbs of its source, and nothing for anybody else."""

    def broken(found: Round, before: Before, chosen: random.Random, blocks: str) -> None:
        with gpac.System("campaign", progress=False) as cell:
            made = application.run(cell, blocks, block, at=chosen.randint(1, 30), doomed=doomed)
            expected = {"failing": ("fault", "it"), "pushing": ("fault", None)}
            for name, (condition, culprit) in expected.items():
                found.wrong += _ends_with(made.doomed[name], condition, culprit)
            fault = next((entry for entry in cell.log() if entry["kind"] == "fault"), None)
            if fault is None:
                found.wrong.append("the log has no fault")
            else:
                found.reported_s = cell.now - fault["time_s"]
            found.wrong += _goes_on(made)
            for instance in (made.healthy, made.doomed["bystander"]):
                instance.halt()
                found.wrong += [] if instance.report and instance.report.condition == "halted" else [f"'{instance.name}' was not halted"]

    return accounted(broken)


def of_a_processor(how: str) -> Callable[[random.Random, str], Round]:
    """The process of a processor dies: `processor_lost` for every verb that has a block there, and nothing for anybody else."""

    def broken(found: Round, before: Before, chosen: random.Random, blocks: str) -> None:
        with gpac.System("campaign", progress=False) as cell:
            aborts = how == "aborts"
            made = application.run(cell, blocks, "aborts" if aborts else "counts", at=chosen.randint(1, 60), doomed=PROCESS)
            killed_s = cell.now
            if not aborts:
                with contextlib.suppress(TimeoutError):
                    made.healthy.wait(timeout=chosen.uniform(0.0, 0.1))
                killed_s = cell.now
                os.kill(_pid(before), signal.SIGKILL)
            for instance in made.doomed.values():
                found.wrong += _ends_with(instance, "processor_lost", None)
            if not aborts:
                found.reported_s = cell.now - killed_s
            found.wrong += _goes_on(made)
            made.healthy.halt()

    return accounted(broken)


def _pid(before: Before) -> int:
    """The one process that has come: that of the doomed processor."""
    (pid,) = [pid for pid in before.new() if "run_processor" in command_of(pid)]
    return pid


def of_everything(doomed: Mapping[str, Any]) -> Callable[[random.Random, str], Round]:
    """kill -9 of the process of programming system and supervisor, at a random instant: nothing is left, no processor either."""

    def broken(found: Round, _: Before, chosen: random.Random, blocks: str) -> None:
        _kill_victim(found, chosen, [sys.executable, str(VICTIM), blocks, json.dumps(dict(doomed))])

    return accounted(broken)


def _kill_victim(found: Round, chosen: random.Random, command: list[str]) -> None:
    with subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True) as victim:
        assert victim.stdin and victim.stdout
        for _ in range(chosen.randint(1, 40)):
            line = victim.stdout.readline()
            if not line.startswith("count "):
                found.wrong.append(f"the victim said {line!r}")
                break
        os.kill(victim.pid, signal.SIGKILL)
        victim.wait()


def _ends_with(instance: gpac.VerbInstance, condition: str, block: str | None) -> list[str]:
    try:
        report = instance.wait(timeout=LIMIT)
    except gpac.Terminated as end:
        if (end.condition, end.block) == (condition, block):
            return []
        return [f"'{instance.name}' ended with '{end.condition}' of block {end.block!r} instead of '{condition}' of {block!r}"]
    except TimeoutError:
        return [f"'{instance.name}' has no end report after {LIMIT}"]
    return [f"'{instance.name}' ended normally, with '{report.condition}'"]


def _goes_on(made: application.Application) -> list[str]:
    before = made.count.value
    try:
        made.healthy.wait(timeout="10 ms")
    except TimeoutError:
        return [] if made.count.value > before else ["the healthy verb stands still"]
    return ["the healthy verb has ended"]


KINDS = {
    kind.name: kind
    for kind in (
        Kind("segfault in a block", 100, 3, in_a_block("segfaults")),
        Kind("division by zero in a block", 50, 2, in_a_block("divides")),
        Kind("illegal instruction in a block", 50, 2, in_a_block("illegal")),
        Kind("runaway loop in a block", 50, 2, in_a_block("runs_away")),
        Kind("segfault in a block of a process", 50, 2, in_a_block("segfaults", PROCESS)),
        Kind("runaway loop in a block of a process", 50, 1, in_a_block("runs_away", PROCESS)),
        Kind("abort in a block of a process", 100, 3, of_a_processor("aborts")),
        Kind("kill -9 of a processor", 200, 5, of_a_processor("is killed")),
        Kind("kill -9 of everything, on threads", 50, 1, of_everything(THREAD)),
        Kind("kill -9 of system and supervisor", 100, 3, of_everything(PROCESS)),
    )
}
