# SPDX-License-Identifier: Apache-2.0
"""A soak: 1,000 blocks at 1 kHz, a verb every 50 ms, a recorder and a scope, for hours. Nothing may be lost, and memory stays level.

    python tests/faults/soak.py                  two hours
    python tests/faults/soak.py --minutes 10     ten minutes
    python tests/faults/soak.py --virtual        the same under the virtual clock, as fast as possible

A chain of blocks numbers its firings. Its last value goes to an SVV, to a reader on another source that expects each number, into a
recording (a new one each minute; the previous one is read back) and to a scope over the control interface. In parallel a process on
each core only sleeps from period to period: an overrun at a time in which that process was late too is blamed on the machine.
Overruns are reported, not judged. The soak fails if a number, a row, a frame or an event was lost, a verb did not end as expected, or
memory, descriptors or threads grew over the second half. Ctrl-C ends it with the report so far; the report is in `out/soak.json`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import opengpac as gpac
import wakes
from opengpac import _native, activate, on
from scope import Scope
from shift import resident_mb

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "soak.json"
PERIOD_NS = 1_000_000
EVERY_S = 0.05
"""Interval between starts of a verb."""
FIRINGS_A_VERB = 5
MINUTE_S = 60.0
LOOKS_A_MINUTE = 60
GROWTH_MB_MAX = 8.0
"""Maximum growth of memory in the second half, by a line fitted to its measurements."""
GROWTH_COUNT_MAX = 8
"""Maximum growth of descriptors and threads; the start or end of a recording temporarily needs a few more."""
JUDGED_S = 240.0
"""Minimum duration for a verdict on memory: before it log, end reports and caches fill up to their bounds."""
STALLED_S = 60.0


@dataclass
class Look:
    """Measurements at an instant."""

    second: float
    firings: int
    overruns: int
    resident_mb: float
    descriptors: int
    threads: int


@dataclass
class Found:
    """Report of the soak."""

    blocks: int
    asked_s: float
    seconds: float = 0.0
    interrupted: bool = False
    firings: int = 0
    overruns: int = 0
    overruns_beside_late_wakes: int = 0
    late_wakes: int = 0
    latest_wake_ms: float = 0.0
    verbs: int = 0
    slots_missed: int = 0
    numbers: int = 0
    rows: int = 0
    recordings: int = 0
    frames: int = 0
    values_in_frames: int = 0
    grown_mb: float | None = None
    lost: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    looks: list[Look] = field(default_factory=list)

    def lose(self, what: str, count: int) -> None:
        """Notes a loss."""
        if count:
            self.lost[what] = self.lost.get(what, 0) + count


class Machine:
    """The chain, its readers, and the short-lived verbs."""

    def __init__(self, cell: gpac.System, module: str, blocks: int) -> None:
        self.cell = cell
        self.code = cell.download(module, "ring")
        processor = cell.processor("soak")
        self.fast = processor.timer("fast", period="1 ms", priority=80)
        self.soft = processor.software("soft", priority=60)
        self.sent, self.counted = cell.svv("sent"), cell.svv("counted")
        self.seen, self.missed = cell.svv("seen", "int64_t"), cell.svv("missed", "int64_t")
        self.chain = self._chain(blocks - 2).on(self.fast).new_instance(self.sent)
        self.expecting = self._expecting().on(self.soft).asynch(self.sent, self.seen, self.missed)
        self.chain.start()
        self._short = self._counting().on(self.fast)

    def a_verb(self) -> str | None:
        """Runs a short verb to its end; returns its fault, if any."""
        report = self._short(self.counted, limit=float(FIRINGS_A_VERB), time_limit="60 s")
        if (report.condition, report.last, report.others) == ("enough", FIRINGS_A_VERB, ()):
            return None
        return f"a verb ended with {report.condition!r} at {report.last}"

    def look(self, second: float) -> Look:
        """Returns the present measurements."""
        source = self.cell.statistics["sources"][self.fast.name]
        descriptors, threads = len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))
        return Look(second, source["firings"], source["overruns"], resident_mb(), descriptors, threads)

    def losses(self) -> Iterator[tuple[str, int]]:
        """Yields the losses that the system itself counts."""
        yield "numbers at the reader", int(self.missed.value)
        for name, source in self.cell.statistics["sources"].items():
            yield f"events of {name}", source["lost"]
            yield f"values late at {name}", source["late"]

    def _chain(self, length: int) -> gpac.Verb[..., Any]:
        labels = ["number", *(f"along{n}" for n in range(length))]
        return gpac.Verb(
            "chain",
            blocks={label: self.code.along if label != "number" else self.code.number for label in labels},
            instantiation_parameters={"sent": f"{labels[-1]}.y"},
            cells={label: [f"{before}.y", f"{label}.u"] for before, label in pairwise(labels)},
            command_lists={"start": [*(activate(label) for label in labels[1:]), activate("number", every="1 ms")]},
        )

    def _expecting(self) -> gpac.Verb[..., Any]:
        return gpac.Verb(
            "expecting",
            blocks={"it": self.code.expects},
            instantiation_parameters={"u": "it.u", "seen": "it.seen", "lost": "it.lost"},
            command_lists={"start": [activate("it")]},
        )

    def _counting(self) -> gpac.Verb[..., Any]:
        return gpac.Verb(
            "counting",
            blocks={"it": self.code.until},
            instantiation_parameters={"y": "it.y"},
            input_parameters={"limit": "it.enough"},
            output_values={"last": "it.y"},
            command_lists={"start": [activate("it", every="1 ms")]},
            conditions={"enough": on("it.enough", returns=["last"])},
        )


def read_back(path: Path) -> tuple[int, int]:
    """Returns the rows of a recording and the number missing between them; deletes the file."""
    values = gpac.Recorded(path)["sent"]["value"]
    path.unlink()
    return len(values), int((np.diff(values) - 1).sum())


class Recordings:
    """Consecutive recordings; each is read back while the next one runs."""

    def __init__(self, cell: gpac.System, folder: Path, found: Found) -> None:
        self._cell, self._folder, self._found = cell, folder, found
        self._reader = ThreadPoolExecutor(1, "soak-reader")
        self._read: list[Future[tuple[int, int]]] = []
        self._begin()

    def next(self) -> None:
        """Ends the running recording and starts the next."""
        self._end()
        self._begin()

    def finish(self) -> None:
        """Ends the last recording and waits until all are read."""
        self._end()
        self._reader.shutdown()
        self.collect()

    def collect(self) -> None:
        """Adds up the results of the recordings that have been read."""
        for read in [read for read in self._read if read.done()]:
            self._read.remove(read)
            rows, missing = read.result()
            self._found.rows += rows
            self._found.lose("rows missing in recordings", missing)

    def _begin(self) -> None:
        self._path = self._folder / f"{self._found.recordings}.mcap"
        self._running = self._cell.record(self._path, ["sent", "counted"])
        self._found.recordings += 1

    def _end(self) -> None:
        for channel, count in self._running.stop().items():
            self._found.lose(f"rows of {channel} that the recorder tells", count)
        if self._running.failure:
            self._found.wrong.append(f"a recording failed: {self._running.failure}")
        self._read.append(self._reader.submit(read_back, self._path))


class Pace:
    """Slots of 50 ms, of real time or of the virtual clock."""

    def __init__(self, cell: gpac.System, is_virtual: bool) -> None:
        self._cell, self._is_virtual = cell, is_virtual
        self._begin = self._now()
        self.slot = 0
        self.missed = 0

    @property
    def second(self) -> float:
        """Returns the seconds since the beginning."""
        return self._now() - self._begin

    def next_slot(self) -> None:
        """Waits for the next slot; counts missed ones."""
        gone = int(self.second / EVERY_S)
        self.missed += max(0, gone - self.slot)
        self.slot = max(self.slot, gone) + 1
        wait_s = self.slot * EVERY_S - self.second
        if self._is_virtual:
            self._cell.advance(wait_s)
        else:
            time.sleep(max(0.0, wait_s))

    def _now(self) -> float:
        return self._cell.now if self._is_virtual else time.monotonic()


def soak(cell: gpac.System, module: str, found: Found, folder: Path, *, is_virtual: bool, say: Any = print) -> None:
    """Runs for the time requested in `found`, or until Ctrl-C."""
    machine = Machine(cell, module, found.blocks)
    recordings = Recordings(cell, folder, found)
    with Scope(cell, folder) as scope:
        pace = Pace(cell, is_virtual)
        look_due, minute_due = 0.0, MINUTE_S
        try:
            while pace.second < found.asked_s:
                pace.next_slot()
                if wrong := machine.a_verb():
                    found.wrong.append(wrong)
                found.verbs += 1
                if pace.second >= look_due:
                    look_due += MINUTE_S / LOOKS_A_MINUTE
                    found.looks.append(machine.look(pace.second))
                if pace.second >= minute_due:
                    minute_due += MINUTE_S
                    recordings.next()
                    recordings.collect()
                    say(progress(found, scope, machine), flush=True)
        except KeyboardInterrupt:
            found.interrupted = True
        found.looks.append(machine.look(pace.second))
        machine.chain.halt()
        recordings.finish()
        settle(machine, is_virtual)
        found.seconds, found.slots_missed = pace.second, pace.missed
        conclude(found, machine, scope)


def settle(machine: Machine, is_virtual: bool) -> None:
    """Lets the reader take the values in transit."""
    end = time.monotonic() + STALLED_S
    while machine.seen.value + machine.missed.value < machine.sent.value and time.monotonic() < end:
        if is_virtual:
            machine.cell.advance("10 ms")
        else:
            time.sleep(0.01)


def progress(found: Found, scope: Scope, machine: Machine) -> str:
    """Returns the progress line of a minute."""
    look = found.looks[-1]
    return (
        f"{look.second / 60:.0f} min: {found.blocks} blocks, {look.firings} firings, {look.overruns} overruns; {found.verbs} verbs; "
        f"{found.rows} rows; {scope.frames} frames with {scope.values} values; "
        f"lost: {sum(found.lost.values()) + scope.lost + int(machine.missed.value)}; "
        f"{look.resident_mb:.1f} MB, {look.descriptors} descriptors, {look.threads} threads"
    )


def conclude(found: Found, machine: Machine, scope: Scope) -> None:
    """Counts the losses, and checks whether anything grew."""
    found.firings, found.overruns = found.looks[-1].firings, found.looks[-1].overruns
    found.numbers = int(machine.seen.value)
    found.frames, found.values_in_frames = scope.frames, scope.values
    found.lose("values that the scope tells", scope.lost)
    found.lose("values missing in frames", scope.missing)
    for what, count in machine.losses():
        found.lose(what, count)
    if scope.failure:
        found.wrong.append(scope.failure)
    if found.numbers != machine.sent.value:
        found.wrong.append(f"the chain has numbered {machine.sent.value:.0f} firings, its reader has {found.numbers}")
    if found.seconds < JUDGED_S:
        return
    half = [look for look in found.looks if look.second > found.seconds / 2]
    slope = np.polyfit([look.second for look in half], [look.resident_mb for look in half], 1)[0]
    found.grown_mb = float(slope * found.seconds / 2)
    if found.grown_mb > GROWTH_MB_MAX:
        found.wrong.append(f"memory grew by {found.grown_mb:.1f} MB in the second half")
    for what in ("descriptors", "threads"):
        grown = getattr(half[-1], what) - getattr(half[0], what)
        if grown > GROWTH_COUNT_MAX:
            found.wrong.append(f"there are {grown} {what} more at the end than in the middle")


def judge_overruns(found: Found, files: dict[int, Path], begin_ns: int) -> None:
    """Counts the overruns that coincide with late wake-ups of a process that only sleeps."""
    late = wakes.misses(files)
    found.late_wakes, found.latest_wake_ms = len(late), max((by for _, _, by in late), default=0) * 1e-6
    times = [(at - begin_ns) * 1e-9 for _, at, by in late if by >= PERIOD_NS // 2]
    for before, after in pairwise(found.looks):
        if any(before.second <= at <= after.second for at in times):
            found.overruns_beside_late_wakes += after.overruns - before.overruns


def report(found: Found) -> int:
    """Prints and writes the report; returns the exit code."""
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(asdict(found), indent=1) + "\n")
    stopped = f", interrupted (of {found.asked_s / 60:.0f} min)" if found.interrupted else ""
    print(f"{found.seconds / 60:.1f} min{stopped}: {found.blocks} blocks at 1 kHz, {found.firings} firings, {found.numbers} numbers read")
    print(f"{found.verbs} verbs, one each 50 ms; {found.slots_missed} slots went by while the one before still ran")
    print(f"{found.rows} rows in {found.recordings} recordings; {found.values_in_frames} values in {found.frames} frames of the scope")
    print(
        f"{found.overruns} overruns, {found.overruns_beside_late_wakes} of them in seconds in which a process that only sleeps was late: "
        f"it was {found.late_wakes} times late by half a period, at most by {found.latest_wake_ms:.1f} ms"
    )
    if found.looks:
        first, last = found.looks[0], found.looks[-1]
        grown = "" if found.grown_mb is None else f", {found.grown_mb:+.2f} MB in the second half"
        print(f"memory {first.resident_mb:.1f} MB → {last.resident_mb:.1f} MB{grown}")
        print(f"{last.descriptors} descriptors and {last.threads} threads at the end")
    print("lost: " + (", ".join(f"{count} {what}" for what, count in found.lost.items()) or "nothing"))
    for wrong in found.wrong[:20]:
        print(f"wrong: {wrong}")
    return int(bool(found.lost or found.wrong or not found.rows or not found.frames))


def build(folder: Path) -> str:
    """Builds the module of the chain."""
    return _native.build([str(HERE / "ring.c")], str(folder / "ring.so"))


def main() -> int:
    """Runs the soak; returns 0 if nothing was lost and nothing grew."""
    parser = argparse.ArgumentParser(description="1,000 blocks at 1 kHz, a verb every 50 ms, a recorder and a scope: nothing is lost.")
    parser.add_argument("--minutes", type=float, default=120.0)
    parser.add_argument("--blocks", type=int, default=1000)
    parser.add_argument("--virtual", action="store_true", help="under the virtual clock, as fast as it goes")
    options = parser.parse_args()
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    found = Found(options.blocks, options.minutes * 60)
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder = Path(name)
        module = build(folder)
        files = {} if options.virtual else stack.enter_context(wakes.measured(PERIOD_NS, folder))
        clock: dict[str, Any] = {"clock": "virtual"} if options.virtual else {}
        with gpac.System("soak", progress=False, **clock) as cell:
            begin_ns = time.monotonic_ns()
            soak(cell, module, found, folder, is_virtual=options.virtual)
        judge_overruns(found, files, begin_ns)
    return report(found)


if __name__ == "__main__":
    sys.exit(main())
