# SPDX-License-Identifier: Apache-2.0
"""A fault of a campaign and its consequences, and the common parts of all kinds of faults."""

from __future__ import annotations

import contextlib
import gc
import os
import random
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import application
import opengpac as gpac
from leftovers import Before, command_of
from plant import Watch

THREAD: Mapping[str, Any] = {}
PROCESS: Mapping[str, Any] = {"process": True}
"""Options of the doomed processor."""

LIMIT = "20 s"
"""Time limit of an end report; a safety net, not a measure."""

INSTANT = "OPENGPAC_FAULT_INSTANT"
"""Environment variable with the path of the file into which a failing block writes its instant."""


@dataclass
class Round:
    """Consequences of one fault."""

    wrong: list[str] = field(default_factory=list)
    """Requirements that did not hold."""
    reported_s: float | None = None
    """Time from the fault to the last of its end reports, or to the exception of the waiting client, s."""
    safe_s: float | None = None
    """Time from the fault to the safe outputs, s; `None` if they are not promised."""

    def time_from(self, begin_ns: int) -> None:
        """Notes that everything has been reported now."""
        self.reported_s = (time.monotonic_ns() - begin_ns) * 1e-9

    def expect_safe(self, watch: Watch, begin_ns: int | None, *, by_guard: bool = False) -> None:
        """Checks that the outputs become safe; with `by_guard` the guard must have written them."""
        self.safe_s = watch.safe_s(begin_ns)
        if self.safe_s is None:
            self.wrong.append("the outputs are not safe")
        elif by_guard and not watch.by_guard:
            self.wrong.append("the guard has not written the safe outputs")

    def expect_end(self, instance: gpac.VerbInstance[Any], condition: str, block: str | None = None) -> None:
        """Checks that the instance has an end report, with this condition and the block that caused it."""
        try:
            report = instance.wait(timeout=LIMIT)
        except gpac.Terminated as end:
            if (end.condition, end.block) != (condition, block):
                self.wrong.append(
                    f"'{instance.name}' ended with '{end.condition}' of block {end.block!r} instead of '{condition}' of {block!r}"
                )
        except TimeoutError:
            self.wrong.append(f"'{instance.name}' has no end report after {LIMIT}")
        else:
            self.wrong.append(f"'{instance.name}' ended normally, with '{report.condition}'")

    def expect_healthy(self, made: application.Application) -> None:
        """Checks that the verb on the other processor continues."""
        before = made.count.value
        try:
            made.healthy.wait(timeout="10 ms")
        except TimeoutError:
            if made.count.value <= before:
                self.wrong.append("the healthy verb stands still")
        else:
            self.wrong.append("the healthy verb has ended")


@dataclass(frozen=True)
class Kind:
    """Kind of fault, with the number of rounds in the whole campaign and in the tests."""

    name: str
    full: int
    bounded: int
    make: Callable[[random.Random, str], Round]


Broken = Callable[[Round, Before, random.Random, str], None]
"""Function that makes a fault and notes its consequences; its arguments are the round, the state before, the random choices, and the
module of failing blocks."""


def accounted(broken: Broken) -> Callable[[random.Random, str], Round]:
    """Returns the function that runs a round of a fault and accounts for its leftovers after the system was closed and released."""

    def make(chosen: random.Random, blocks: str) -> Round:
        instant = Path(blocks).with_suffix(".instant")
        instant.unlink(missing_ok=True)
        os.environ[INSTANT] = str(instant)
        found, before = Round(), Before()
        try:
            broken(found, before, chosen, blocks)
        except Exception as why:
            found.wrong.append(f"the round broke off: {type(why).__name__}: {why}")
        gc.collect()
        found.wrong += before.left_over()
        return found

    return make


def instant_ns() -> int | None:
    """Returns the instant at which the block failed, on CLOCK_MONOTONIC, as the block wrote it."""
    with contextlib.suppress(OSError, ValueError):
        return int(Path(os.environ[INSTANT]).read_text())
    return None


def runs_for_a_while(made: application.Application, chosen: random.Random) -> None:
    """Lets the application run to a random instant."""
    with contextlib.suppress(TimeoutError):
        made.healthy.wait(timeout=chosen.uniform(0.0, 0.1))


def started(before: Before, entry: str) -> list[int]:
    """Returns the new processes that run this entry of the native module."""
    return [pid for pid in before.new() if entry in command_of(pid)]
