# SPDX-License-Identifier: Apache-2.0
"""No jump on a simulated arm: whatever is commanded, in whatever order, the references of its servos keep to the limits of each joint.

    python tests/faults/no_jump.py                       100,000 sequences of commands, by their seeds
    python tests/faults/no_jump.py --from 4700 --to 4725   those of one system again

A sequence is six commands to a UR5e with the motions of the library: moves, velocities, paths, lines, stops, halts, suspensions, time
limits, overrides, and now and then a device that is disabled or an emergency stop. In every other system each motion takes over from
the previous one, at any instant. Position, speed and acceleration of the reference are checked every ms. `make test` takes another
slice of the seeds each day. The report is in `out/no_jump.json`.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import json
import multiprocessing
import random
import sys
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

import opengpac as gpac
from opengpac import motion

SEEDS = 100_000
COMMANDS = 6
A_SYSTEM = 25
"""Number of sequences per system; then a new system is created."""
TAKES_OVER_S = 0.05
"""Time after it was switched on, perhaps during a motion of the arm, in which a servo moves its reference from the actual to the
commanded position."""
OUT = Path(__file__).parent.parent.parent / "out" / "no_jump.json"
HOME = gpac.deg([0, -90, 90, -90, -90, 0])


def of_the_day(count: int, day: datetime.date | None = None) -> range:
    """Returns the seeds of a day: every slice has its turn in time."""
    slices = SEEDS // count
    at = (day or datetime.date.today()).toordinal() % slices
    return range(at * count, (at + 1) * count)


class Sequences:
    """Arm under the virtual clock, and sequences of commands to it."""

    def __init__(self, takes_over: bool = False) -> None:
        self.arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort" if takes_over else "refuse").enable()
        self.cell = self.arm.system
        self.limits = np.array([(joint.max_speed, joint.max_acceleration) for joint in self.arm]).T
        self.done: Counter[str] = Counter()
        self._moving: gpac.VerbInstance[Any] | None = None
        self._halted: gpac.VerbInstance[Any] | None = None
        self._off_s: list[tuple[float, float]] = [(0.0, self.cell.now)]
        self._looked_s = self.cell.now

    def run(self, seed: int) -> list[str]:
        """Runs one sequence; returns its faults, with the story of its commands."""
        chosen = random.Random(seed)
        story = []
        for _ in range(COMMANDS):
            story.append(f"{self.cell.now * 1e3:.0f} ms: {self._command(chosen)}")
            self.cell.advance(f"{chosen.choice((1, 2, 5, 20, 60, 150))} ms")
        return [f"seed {seed}: {wrong}\n  " + "\n  ".join(story) for wrong in self._look()]

    @property
    def is_lost(self) -> bool:
        """True if a joint has hit the arm itself or the floor, and was disabled by its following error."""
        return any(joint.state == "fault" for joint in self.arm)

    def close(self) -> None:
        self.cell.close()

    def _command(self, chosen: random.Random) -> str:
        what = chosen.choice(COMMAND_NAMES)
        try:
            told = getattr(self, f"_{what}")(chosen)
            self.done[what] += 1
        except gpac.Error as error:
            told = f"refused: {type(error).__name__}"
            self.done["refused"] += 1
        return f"{what} {told}"

    def _begin(self, verb: Any, *args: Any, **more: Any) -> str:
        self._end()
        limit = {"time_limit": "0.2 s"} if self.done.total() % 5 == 0 else {}
        self._moving = verb.asynch(self.arm, *args, **more, **limit)
        return " ".join(str(np.round(arg, 3).tolist()) for arg in args)

    def _end(self) -> None:
        """Collects the report of an ended motion; a motion that still runs keeps its claims, and the next one is refused."""
        if self._moving is not None and self._moving.done:
            with contextlib.suppress(gpac.Terminated):
                self._moving.wait()
            self._moving = None

    def _move(self, chosen: random.Random) -> str:
        goal = [at + chosen.uniform(-0.5, 0.5) for at in HOME]
        return self._begin(motion.move_absolute, goal, speed=f"{chosen.randint(5, 100)} %", acceleration=f"{chosen.randint(20, 100)} %")

    def _nudge(self, chosen: random.Random) -> str:
        return self._begin(motion.move_relative, [chosen.uniform(-0.05, 0.05) for _ in self.arm], speed="100 %")

    def _velocity(self, chosen: random.Random) -> str:
        return self._begin(motion.move_velocity, [chosen.uniform(-1.0, 1.0) for _ in self.arm])

    def _path(self, chosen: random.Random) -> str:
        here = self.arm.values("commanded")
        points = [[at + chosen.uniform(-0.3, 0.3) for at in here] for _ in range(3)]
        return self._begin(motion.follow, points, blend=chosen.choice((0.0, 0.05)), speed=chosen.uniform(0.1, 1.0))

    def _line(self, chosen: random.Random) -> str:
        x, y, z, *turn = self.arm.pose()
        return self._begin(motion.move_linear, [x + chosen.uniform(-0.1, 0.1), y, z + chosen.uniform(-0.1, 0.1), *turn])

    def _stop(self, _: random.Random) -> str:
        return self._begin(motion.stop)

    def _halt(self, _: random.Random) -> str:
        """Halts once: a second halt is immediate (docs/verbs.md), as intended for insistent callers."""
        if self._moving is None or self._moving is self._halted:
            return "not now"
        self._halted = self._moving
        self._moving.halt()
        return ""

    def _suspend(self, _: random.Random) -> str:
        if self._moving is not None:
            self._moving.suspend()
        return ""

    def _resume(self, _: random.Random) -> str:
        if self._moving is not None:
            self._moving.resume()
        return ""

    def _override(self, chosen: random.Random) -> str:
        self.arm.override = share = chosen.choice((0.0, 0.1, 0.5, 1.0, 1.0))
        return str(share)

    def _wait(self, _: random.Random) -> str:
        self.cell.advance("300 ms")
        return ""

    def _again(self, chosen: random.Random) -> str:
        """Switches everything off and on again now and then; the reference then restarts at the arm's position."""
        if chosen.random() < 0.8:
            return "not now"
        begun_s = self.cell.now
        if chosen.random() < 0.5:
            self.cell.emergency_stop("tested")
            self.cell.reset()
        self.arm.disable()
        self.arm.enable()
        self._off_s.append((begun_s, self.cell.now))
        return "off and on"

    def _look(self) -> Iterable[str]:
        """Checks each ms since the last call."""
        new = round((self.cell.now - self._looked_s) * 1e3) + 5
        rows = [joint.reference.history[-new:] for joint in self.arm]
        since = max(of["time"][0] for of in rows)
        if since > self._looked_s + 1e-3 and not self._off_s:
            yield f"from {self._looked_s} s to {since} s there is no history"
        first = max(since, self._looked_s - 0.002)
        times = rows[0]["time"][rows[0]["time"] >= first - 1e-9]
        found = [of["value"][of["time"] >= first - 1e-9] for of in rows]
        # A joint that hit something has faulted: its reference is no longer followed.
        least = min(len(values) for values in found)
        times, path = times[:least], np.array([values[:least] for values in found]).T
        self._looked_s = self.cell.now
        off = np.zeros(len(times), dtype=bool)
        for begun_s, ended_s in self._off_s:
            off |= (times > begun_s - 0.001) & (times < ended_s + TAKES_OVER_S)
        self._off_s = [of for of in self._off_s if of[1] > self.cell.now - 2 * TAKES_OVER_S]
        steady = (np.abs(np.diff(times) - 1e-3) < 1e-9) & ~off[1:] & ~off[:-1]
        yield from exceeded(times, path, steady, *self.limits)


def exceeded(times: np.ndarray, path: np.ndarray, steady: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> Iterable[str]:
    """Yields the excesses of a path over a joint's limits: the differences between rows, and the differences of these."""
    if not np.isfinite(path).all():
        yield "a reference is no number"
    fast = np.abs(np.diff(path, axis=0)) / 1e-3
    harsh = np.abs(np.diff(path, 2, axis=0)) / 1e-6
    for name, found, limit, is_steady in (
        ("rad/s", fast, speed, steady),
        ("rad/s²", harsh, acceleration, steady[1:] & steady[:-1]),
    ):
        over = (found > limit * (1 + 1e-6) + 1e-9) & is_steady[:, None]
        if over.any():
            at, joint = np.argwhere(over)[0]
            yield f"joint {joint} has {found[at, joint]:.4g} {name} at {times[at + 1] * 1e3:.0f} ms, and its limit is {limit[joint]:.4g}"


COMMAND_NAMES = [
    *("move",) * 3, *("nudge",) * 2, *("velocity",) * 3, "path", "line", *("stop",) * 2, *("halt",) * 3, *("suspend",) * 2,
    *("resume",) * 2, *("override",) * 2, *("wait",) * 2, "again",
]  # fmt: skip


def sequences(seeds: Iterable[int]) -> tuple[list[str], Counter[str]]:
    """Runs the sequences of these seeds until one is wrong; returns its faults, and how often each command was executed."""
    wrong: list[str] = []
    done: Counter[str] = Counter()
    of: Sequences | None = None
    for seed in seeds:
        if of is None or of.is_lost or seed % A_SYSTEM == 0:
            if of is not None:
                of.close()
            of = Sequences(takes_over=seed // A_SYSTEM % 2 == 1)
        before = of.done.copy()
        wrong = of.run(seed)
        done += of.done - before
        if wrong:
            break
    if of is not None:
        of.close()
    return wrong, done


def main() -> int:
    parser = argparse.ArgumentParser(description="Commands a simulated arm in any order, and looks whether its reference jumps.")
    parser.add_argument("--from", dest="first", type=int, default=0)
    parser.add_argument("--to", dest="last", type=int, default=SEEDS)
    options = parser.parse_args()
    begun = time.monotonic()
    wrong: list[str] = []
    done: Counter[str] = Counter()
    # Sequences of one system belong together: each begins where the previous one has left the arm.
    systems = [range(max(at, options.first), min(at + A_SYSTEM, options.last)) for at in range(options.first, options.last, A_SYSTEM)]
    with multiprocessing.get_context("spawn").Pool() as pool:
        for number, (found, commands) in enumerate(pool.imap_unordered(sequences, systems), 1):
            wrong += found
            done += commands
            if found or number % 100 == 0:
                print(f"{number} of {len(systems)} systems", *found, sep="\n", flush=True)
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps({"seeds": [options.first, options.last], "wrong": wrong, "commands": done, "s": time.monotonic() - begun}))
    print(f"{len(wrong)} jumps in {options.last - options.first} sequences of {COMMANDS} commands")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
