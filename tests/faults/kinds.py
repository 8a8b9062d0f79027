# SPDX-License-Identifier: Apache-2.0
"""Kinds of faults of a campaign: the damage of each, and the requirements after it."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

import application
import opengpac as gpac
from apart import VICTIM, of_the_programming_system, of_the_supervisor, said_counts
from leftovers import Before
from plant import Plant, until
from rounds import PROCESS, THREAD, Kind, Round, accounted, instant_ns, runs_for_a_while, started


def in_a_block(block: str, doomed: Mapping[str, Any] = THREAD) -> Callable[[random.Random, str], Round]:
    """Makes a signal or an endless loop inside a block: `fault` for the verbs of its source, and no effect on others."""

    def broken(found: Round, _: Before, chosen: random.Random, blocks: str) -> None:
        with gpac.System("campaign", progress=False) as cell:
            plant = Plant()
            made = application.run(cell, blocks, block, at=chosen.randint(1, 30), doomed=doomed, plant=plant)
            watch = plant.watched()
            for name, culprit in {"failing": "it", "pushing": None}.items():
                found.expect_end(made.doomed[name], "fault", culprit)
            failed_ns = instant_ns()
            if failed_ns is None:
                found.wrong.append("the block has not failed")
            else:
                found.time_from(failed_ns)
            found.expect_safe(watch, failed_ns)
            if not any(entry["kind"] == "fault" for entry in cell.log()):
                found.wrong.append("the log has no fault")
            found.expect_healthy(made)
            for instance in (made.healthy, made.doomed["bystander"]):
                instance.halt()
                found.wrong += [] if instance.report and instance.report.condition == "halted" else [f"'{instance.name}' was not halted"]

    return accounted(broken)


def of_its_process_by_a_block(block: str, *, by_guard: bool = True) -> Callable[[random.Random, str], Round]:
    """Lets a block end the process of its processor: `processor_lost` for every verb with a block there, no effect on others.

    `by_guard`: only the guard can make its outputs safe.
    """

    def broken(found: Round, _: Before, chosen: random.Random, blocks: str) -> None:
        with gpac.System("campaign", progress=False) as cell:
            plant = Plant()
            made = application.run(cell, blocks, block, at=chosen.randint(1, 60), doomed=PROCESS, plant=plant)
            watch = plant.watched()
            for instance in made.doomed.values():
                found.expect_end(instance, "processor_lost")
            failed_ns = instant_ns()
            if failed_ns is None:
                found.wrong.append("the block has not failed")
            else:
                found.time_from(failed_ns)
            found.expect_safe(watch, failed_ns, by_guard=by_guard)
            found.expect_healthy(made)
            made.healthy.halt()

    return accounted(broken)


def of_a_processor(found: Round, before: Before, chosen: random.Random, blocks: str) -> None:
    """kill -9 of a processor's process at a random instant: the same effect as an abort."""
    with gpac.System("campaign", progress=False) as cell:
        plant = Plant()
        made = application.run(cell, blocks, "counts", at=0, doomed=PROCESS, plant=plant)
        runs_for_a_while(made, chosen)
        (processor,) = started(before, "run_processor")
        _kill_processor(found, plant, made, processor)
        made.healthy.halt()


def _kill_processor(found: Round, plant: Plant, made: application.Application, processor: int) -> None:
    watch = plant.watched()
    killed_ns = time.monotonic_ns()
    os.kill(processor, signal.SIGKILL)
    for instance in made.doomed.values():
        found.expect_end(instance, "processor_lost")
    found.time_from(killed_ns)
    found.expect_safe(watch, killed_ns, by_guard=True)
    found.expect_healthy(made)


def of_the_guard(found: Round, before: Before, chosen: random.Random, blocks: str) -> None:
    """kill -9 of the guard: another one takes over all registrations, including those of processes that die before it starts."""
    with gpac.System("campaign", progress=False) as cell:
        plant = Plant()
        made = application.run(cell, blocks, "counts", at=0, doomed=PROCESS, plant=plant)
        runs_for_a_while(made, chosen)
        guards, (processor,) = started(before, "run_guard"), started(before, "run_processor")
        guard = chosen.choice(sorted(guards))
        os.kill(guard, signal.SIGKILL)
        if chosen.random() < 0.5:
            until(lambda: _guards_again(cell), "no other guard guards")
            found.expect_healthy(made)
            if any(instance.done for instance in made.doomed.values()):
                found.wrong.append("a verb ended with the guard")
        _kill_processor(found, plant, made, processor)
        until(lambda: _guards_again(cell), "no other guard guards")
        others = started(before, "run_guard")
        if len(others) != len(guards) or guard in others:
            found.wrong.append(f"the guards after guard {guard} are {others}")
        made.healthy.halt()


def _guards_again(cell: gpac.System) -> bool:
    return any(entry["kind"] == "guard" and "another one guards now" in entry["text"] for entry in cell.log())


def of_everything(doomed: Mapping[str, Any]) -> Callable[[random.Random, str], Round]:
    """kill -9 of the process of programming system and supervisor, at a random instant: nothing is left, not even a processor.

    If the doomed processor is a thread of that process, nothing remains to make its outputs safe, and this is not promised.
    """

    def broken(found: Round, _: Before, chosen: random.Random, blocks: str) -> None:
        plant = Plant()
        told = json.dumps({"blocks": blocks, "doomed": dict(doomed), "plant": plant.name})
        with subprocess.Popen([sys.executable, str(VICTIM), told], stdout=subprocess.PIPE, text=True) as victim:
            if chosen.random() < 0.25:
                _kill_in_its_start(victim, chosen.uniform(0.1, 1.5))
                return
            found.wrong += said_counts(victim, chosen.randint(1, 40))
            watch = plant.watched() if doomed else None
            killed_ns = time.monotonic_ns()
            victim.kill()
            victim.wait()
            if watch:
                found.expect_safe(watch, killed_ns)

    return accounted(broken)


def _kill_in_its_start(victim: subprocess.Popen[str], after_s: float) -> None:
    """Kills a starting process; nothing that it was creating may remain."""
    try:
        victim.wait(after_s)
    except subprocess.TimeoutExpired:
        victim.kill()
        victim.wait()


KINDS = {
    kind.name: kind
    for kind in (
        Kind("segfault in a block", 100, 3, in_a_block("segfaults")),
        Kind("division by zero in a block", 50, 2, in_a_block("divides")),
        Kind("illegal instruction in a block", 50, 2, in_a_block("illegal")),
        Kind("runaway loop in a block", 50, 2, in_a_block("runs_away")),
        Kind("segfault in a block of a process", 50, 2, in_a_block("segfaults", PROCESS)),
        Kind("runaway loop in a block of a process", 50, 1, in_a_block("runs_away", PROCESS)),
        Kind("abort in a block", 50, 1, in_a_block("aborts")),
        Kind("abort in a block of a process", 50, 1, in_a_block("aborts", PROCESS)),
        Kind("loop around malloc in a block", 100, 1, in_a_block("allocates")),
        Kind("loop around printf in a block", 100, 1, in_a_block("prints")),
        Kind("loop around printf in a block of a process", 50, 1, in_a_block("prints", PROCESS)),
        Kind("wait that nothing ends in a block of a process", 50, 1, of_its_process_by_a_block("waits", by_guard=False)),
        Kind("end of its process by a block", 100, 2, of_its_process_by_a_block("ends_its_process")),
        Kind("kill -9 of a processor", 200, 5, accounted(of_a_processor)),
        Kind("kill -9 of the guard", 50, 2, accounted(of_the_guard)),
        Kind("kill -9 of the supervisor, a daemon", 100, 2, accounted(of_the_supervisor)),
        Kind("kill -9 of the programming system", 100, 2, accounted(of_the_programming_system)),
        Kind("kill -9 of everything, on threads", 50, 1, of_everything(THREAD)),
        Kind("kill -9 of system and supervisor", 100, 3, of_everything(PROCESS)),
    )
}
