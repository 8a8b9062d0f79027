# SPDX-License-Identifier: Apache-2.0
"""Sixteen processors in a ring, a thousand blocks at 250 Hz: counts losses, and checks whether the machine itself was late at the time.

    python tests/faults/sixteen.py                   ten minutes, four processes with four processors each
    python tests/faults/sixteen.py --processes 16    a process each
    python tests/faults/sixteen.py --processes 0     all are threads of this process

Each processor numbers its firings and passes the numbers along a chain; the next processor expects each of them. In parallel a
process on each core sleeps from period to period. A skipped release or a missing number at a time in which that process was late too
is blamed on the machine; any other is a failure, and a lost number ends the run. The report is in `out/sixteen.json`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import opengpac as gpac
import wakes
from opengpac import _native, activate

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "sixteen.json"
PROCESSORS = 16
PERIOD_NS = 4_000_000
NUMBERS = "numbers lost"
LOOK = "250 ms"
"""Interval of the checks for losses."""


@dataclass
class Loss:
    """Loss between two checks."""

    begin_ns: int
    end_ns: int
    what: str
    by_machine: bool = False

    @property
    def is_number(self) -> bool:
        """True if a number is missing, and not only a firing late."""
        return self.what.endswith(NUMBERS)


@dataclass
class Found:
    """Report of the run."""

    processors: int
    processes: int
    blocks: int
    asked_s: float
    begin_ns: int = 0
    seconds: float = 0.0
    firings: int = 0
    numbers: int = 0
    losses: list[Loss] = field(default_factory=list)
    late_wakes: int = 0
    latest_wake_ms: float = 0.0


class Ring:
    """Cell with the ring of processors."""

    def __init__(self, cell: gpac.System, module: str, blocks: int, processes: int) -> None:
        self.cell = cell
        self.code = cell.download(module, "ring")
        self.blocks = 0
        self.seen, self.lost = [], []
        self.instances: list[gpac.VerbInstance[Any]] = []
        sources = []
        for number in range(PROCESSORS):
            # Neighbours share a process: most of the ring is within processes, and it crosses from each to the next.
            made = cell.processor(f"rtp{number}", process=f"cell-{number * processes // PROCESSORS}" if processes else False)
            sources.append((made.timer("fast", period="4 ms", priority=70), made.software("soft", priority=60)))
        sent = [cell.svv(f"sent{number}") for number in range(PROCESSORS)]
        each = blocks // PROCESSORS
        writers = [self._numbering(n, each - 2).on(fast).new_instance(sent[n]) for n, (fast, _) in enumerate(sources)]
        for number, (_, soft) in enumerate(sources):
            self.instances.append(self._expecting(number).on(soft).asynch(sent[number - 1], *self._counters(number)))
        for writer in writers:
            self.instances.append(writer.start())
            self.blocks += each

    def counts(self) -> dict[str, int]:
        """Returns every count that must stay at 0, by name."""
        sources = self.cell.statistics["sources"]
        skipped = {f"{name}: releases skipped": source["overruns"] for name, source in sources.items()}
        late = {f"{name}: values late": source["late"] for name, source in sources.items()}
        return {**skipped, **late, **{f"{svv.name}: {NUMBERS}": int(svv.value) for svv in self.lost}}

    def _counters(self, number: int) -> list[gpac.SVV[Any]]:
        self.seen.append(self.cell.svv(f"seen{number}", "int64_t"))
        self.lost.append(self.cell.svv(f"lost{number}", "int64_t"))
        return [self.seen[-1], self.lost[-1]]

    def _expecting(self, number: int) -> gpac.Verb[..., Any]:
        return gpac.Verb(
            f"expecting{number}",
            blocks={"it": self.code.expects},
            instantiation_parameters={"u": "it.u", "seen": "it.seen", "lost": "it.lost"},
            command_lists={"start": [activate("it")]},
        )

    def _numbering(self, number: int, length: int) -> gpac.Verb[..., Any]:
        chain = [f"along{n}" for n in range(length)]
        return gpac.Verb(
            f"numbering{number}",
            blocks={"number": self.code.number, **dict.fromkeys(chain, self.code.along)},
            instantiation_parameters={"sent": f"{chain[-1]}.y"},
            cells={label: [f"{before}.y", f"{label}.u"] for before, label in zip(["number", *chain], chain, strict=False)},
            command_lists={"start": [*(activate(label) for label in chain), activate("number", every="4 ms")]},
        )


def watch(ring: Ring, seconds: float, files: dict[int, Path], found: Found) -> None:
    """Observes the ring for `seconds`, or until a number was lost for which the machine is not to blame."""
    before, begin = ring.counts(), time.monotonic_ns()
    start = found.begin_ns = begin
    while time.monotonic_ns() - start < seconds * 1e9:
        # The losses of the last check wait for the next one: a machine that was late reports it late.
        judged = len(found.losses)
        with contextlib.suppress(TimeoutError):
            ring.instances[0].wait(timeout=LOOK)
        now, end = ring.counts(), time.monotonic_ns()
        found.losses += [Loss(begin, end, f"{now[what] - before[what]} {what}") for what in now if now[what] > before.get(what, 0)]
        before, begin = now, end
        if judged:
            blame(found.losses[:judged], wakes.misses(files))
            if any(loss.is_number and not loss.by_machine for loss in found.losses[:judged]):
                break
    found.seconds = (begin - start) * 1e-9
    found.numbers = sum(int(svv.value) for svv in ring.seen)
    found.firings = sum(source["firings"] for source in ring.cell.statistics["sources"].values())


def blame(losses: list[Loss], late: list[tuple[int, int, int]]) -> None:
    """Marks the losses that occurred while the machine itself was late by a period."""
    for loss in losses:
        loss.by_machine = any(loss.begin_ns <= at and at - by <= loss.end_ns and by >= PERIOD_NS for _, at, by in late)


def main() -> int:
    parser = argparse.ArgumentParser(description="Sixteen processors in a ring, a thousand blocks at 250 Hz.")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--blocks", type=int, default=1008)
    parser.add_argument(
        "--processes", type=int, default=4, choices=[0, 1, 2, 4, 8, 16], help="how many the processors share; 0: none but this"
    )
    options = parser.parse_args()
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    with tempfile.TemporaryDirectory() as folder, gpac.System("sixteen", progress=False) as cell:
        module = _native.build([str(HERE / "ring.c")], str(Path(folder) / "ring.so"))
        ring = Ring(cell, module, options.blocks, options.processes)
        found = Found(PROCESSORS, options.processes, ring.blocks, options.seconds)
        with wakes.measured(PERIOD_NS, Path(folder)) as files:
            watch(ring, options.seconds, files, found)
        late = wakes.misses(files)
        blame(found.losses, late)
        found.late_wakes, found.latest_wake_ms = len(late), max((by for _, _, by in late), default=0) * 1e-6
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(asdict(found), indent=1) + "\n")
    own = [loss for loss in found.losses if not loss.by_machine]
    print(
        f"{found.processors} processors in {found.processes or 1} processes, {found.blocks} blocks at 250 Hz, {found.seconds:.1f} s: "
        f"{found.firings} firings, "
        f"{found.numbers} numbers from processor to processor"
    )
    if any(loss.is_number for loss in own):
        print(f"ended after {found.seconds:.1f} of {found.asked_s:.0f} s: a number was lost that the machine is not to blame for")
    print(f"lost: {len(own)} times; and {len(found.losses) - len(own)} times while this machine was late itself")
    print(f"the machine: {found.late_wakes} wakes later than half a period, the latest by {found.latest_wake_ms:.1f} ms")
    for loss in own:
        print(f"within the 250 ms from {(loss.begin_ns - found.begin_ns) * 1e-9:.2f} s on: {loss.what}")
    return 1 if own or found.numbers == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
