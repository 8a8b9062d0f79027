# SPDX-License-Identifier: Apache-2.0
"""One fault of a campaign and what it led to, with what every kind of fault has in common."""

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
"""What the doomed processor is."""

LIMIT = "20 s"
"""How long an end report may take; a net, not a measure."""

INSTANT = "OPENGPAC_FAULT_INSTANT"
"""The file in which a block that fails leaves when it did."""


@dataclass
class Round:
    """What one fault led to."""

    wrong: list[str] = field(default_factory=list)
    """What did not hold, in words."""
    reported_s: float | None = None
    """From the fault to the last of its end reports, or to the exception of who waited, s."""
    safe_s: float | None = None
    """From the fault to the safe outputs, s; None where nobody promises them."""

    def time_from(self, begin_ns: int) -> None:
        """Everything is reported now."""
        self.reported_s = (time.monotonic_ns() - begin_ns) * 1e-9

    def expect_safe(self, watch: Watch, begin_ns: int | None, *, by_guard: bool = False) -> None:
        """The outputs must be safe; `by_guard`: it is the guard that must have written them."""
        self.safe_s = watch.safe_s(begin_ns)
        if self.safe_s is None:
            self.wrong.append("the outputs are not safe")
        elif by_guard and not watch.by_guard:
            self.wrong.append("the guard has not written the safe outputs")

    def expect_end(self, instance: gpac.VerbInstance[Any], condition: str, block: str | None = None) -> None:
        """The instance must have an end report, of this condition and the block that caused it."""
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
        """The verb on the other processor must go on."""
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
    """A kind of fault: how often the whole campaign makes it, and how often the tests do."""

    name: str
    full: int
    bounded: int
    make: Callable[[random.Random, str], Round]


Broken = Callable[[Round, Before, random.Random, str], None]
"""Makes a fault and notes what followed: the round, what there was before, the choices, the module of the blocks that fail."""


def accounted(broken: Broken) -> Callable[[random.Random, str], Round]:
    """A round of a fault, with what it left behind once the system is closed and nobody holds it any more."""

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
    """When the block failed, on CLOCK_MONOTONIC, as it left it."""
    with contextlib.suppress(OSError, ValueError):
        return int(Path(os.environ[INSTANT]).read_text())
    return None


def runs_for_a_while(made: application.Application, chosen: random.Random) -> None:
    """Lets the application run to a random instant."""
    with contextlib.suppress(TimeoutError):
        made.healthy.wait(timeout=chosen.uniform(0.0, 0.1))


def started(before: Before, entry: str) -> list[int]:
    """The processes that have come and run this entry of the native module."""
    return [pid for pid in before.new() if entry in command_of(pid)]
