# SPDX-License-Identifier: Apache-2.0
"""Kills and stops any one or two of guard (both its processes), supervisor and processor, with processors as threads and as processes:
the rest makes the outputs safe.

    python tests/faults/watched.py                       1,000 of them, and a supervisor that is stopped for 30 s
    python tests/faults/watched.py --count 60 --seed 7   fewer; a seed and a number make the same attack again

In parallel a process on each core sleeps from period to period. If one of them woke late, the machine is to blame for the attack's
duration: the attack counts only for its results. The report is in `out/watched.json`; the campaign fails if any requirement did not
hold. Ctrl-C ends it with the results so far.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import leftovers
import wakes
from leftovers import Before, command_of
from plant import Plant, until

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "watched.json"
KILL, STOP = "kill", "stop"
SIGNALS = {KILL: signal.SIGKILL, STOP: signal.SIGSTOP}
BOUND_MS = {KILL: 10.0, STOP: 250.0}
"""Time limit from the attack to the plant's first step under its safe commands."""
TIMEOUT = "6 ms"
"""Timeout of the plant's own watchdog, for attacks that leave no one else: those on the program and its guard."""
STANDS_S = 30.0
LATE_NS = 1_000_000
"""A wake-up this late means that the core held up everything on it."""


@dataclass(frozen=True)
class Attack:
    """Victims and kind of an attack; `process`: whether the processor is a process, rather than threads of the program (which is the
    supervisor)."""

    process: bool
    how: tuple[tuple[str, str], ...]

    @property
    def name(self) -> str:
        """Description of the attack."""
        return f"{'process' if self.process else 'threads'}: " + ", ".join(f"{how} {who}" for who, how in self.how)

    @property
    def endangers(self) -> str | None:
        """Attack on the plant's commander; `None` if it continues."""
        how = dict(self.how)
        if not self.process:
            return how.get("program")
        # A killed supervisor takes with it the instances that halt without it; a stopped one is waited for.
        return how.get("processor") or (KILL if how.get("program") == KILL else None)

    @property
    def is_left_alone(self) -> bool:
        """True if no watcher is left except the plant's own watchdog."""
        return not self.process and len(self.how) == 2


def attacks() -> list[Attack]:
    """Returns the attacks on every victim and every pair."""
    found = []
    for process, who in ((False, ("guard", "program")), (True, ("guard", "program", "processor"))):
        for count in (1, 2):
            for targets in itertools.combinations(who, count):
                found += [Attack(process, tuple(zip(targets, how, strict=True))) for how in itertools.product((KILL, STOP), repeat=count)]
    return found


@dataclass
class Round:
    """Consequences of one attack."""

    attack: str
    bound: str | None
    safe_ms: float | None = None
    by_machine: bool = False
    wrong: list[str] = field(default_factory=list)


class Program:
    """Program with its guard and its processor."""

    def __init__(self, plant: Plant, *, process: bool, timeout: str | None = None, if_cut_off: str | None = None) -> None:
        told = {"plant": plant.name, "process": process, "timeout": timeout, "if_cut_off": if_cut_off}
        command = [sys.executable, str(HERE / "watched_program.py"), json.dumps(told)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._line() == "ready\n"

    def _line(self) -> str:
        assert self.process.stdout
        return self.process.stdout.readline()

    def ask(self, what: str) -> str:
        """Sends a request; returns the program's answer."""
        assert self.process.stdin
        self.process.stdin.write(f"{what}\n")
        self.process.stdin.flush()
        return self._line()

    def pids(self, who: str) -> list[int]:
        """Returns the processes of a part of the program."""
        if who == "program":
            return [self.process.pid]
        return self.started({"guard": "run_guard", "processor": "run_processor"}[who])

    def started(self, entry: str) -> list[int]:
        """Returns the program's children that run the entry."""
        found: set[int] = set()
        for thread in (Path("/proc") / str(self.process.pid) / "task").iterdir():
            with contextlib.suppress(OSError):
                found |= {int(pid) for pid in (thread / "children").read_text().split() if entry in command_of(int(pid))}
        return sorted(found)

    def end(self) -> None:
        """Ends the program, in order if it still can."""
        self.process.send_signal(signal.SIGCONT)
        try:
            self.process.communicate("close\n", timeout=20)
        except (subprocess.TimeoutExpired, BrokenPipeError, ValueError):
            self.process.kill()
            self.process.wait()


def one(attack: Attack, chosen: random.Random) -> tuple[Round, int, int]:
    """Makes one attack; returns its consequences, and their begin and end, ns."""
    found, before, plant = Round(attack.name, attack.endangers), Before(), Plant()
    timeout = TIMEOUT if attack.is_left_alone else None
    program = Program(plant, process=attack.process, timeout=timeout, if_cut_off="halt" if attack.process else None)
    begun = safe = 0
    try:
        plant.until_pushed()
        pids = {who: program.pids(who) for who, _ in attack.how}
        time.sleep(chosen.uniform(0.03, 0.06))
        guards = program.started("run_guard")
        order = chosen.sample(attack.how, len(attack.how))
        begun = time.monotonic_ns()
        for who, how in order:
            for pid in pids[who]:
                os.kill(pid, SIGNALS[how])
        if attack.endangers:
            safe = safe_ns(plant)
            found.safe_ms = max(0, safe - begun) * 1e-6
        else:
            goes_on(found, plant, program, attack, guards)
            safe = time.monotonic_ns()
    except Exception as why:
        found.wrong.append(f"{type(why).__name__}: {why}")
    finally:
        program.end()
        put_away(before)
    return found, begun, safe


def safe_ns(plant: Plant) -> int:
    """Returns when the plant first obeyed its safe commands, or was seen at rest."""
    instant: list[int] = []

    def is_safe() -> bool:
        state, seen_ns = plant.state(), time.monotonic_ns()
        if state is None:
            raise RuntimeError("the plant is gone")
        if state["is_safe"]:
            instant.append(state["obeyed_ns"])
        elif plant.speed(state) == 0.0:
            instant.append(seen_ns)
        else:
            time.sleep(0.0005)
        return bool(instant)

    until(is_safe, "the outputs are not safe")
    return instant[0]


def goes_on(found: Round, plant: Plant, program: Program, attack: Attack, guards: list[int]) -> None:
    """Checks an attack on no commander: the plant continues, and a guard that was killed or stopped is replaced."""
    attacked = dict(attack.how)
    if "guard" in attacked and "program" not in attacked:
        until(lambda: (now := program.started("run_guard")) != [] and not set(now) & set(guards), "no other guard came")
    else:
        time.sleep(0.3)
    state = plant.state()
    if state is None or state["is_safe"] or plant.speed(state) == 0.0:
        found.wrong.append(f"the plant was to move on, and does not: {state}")
    if attacked.get("program") != STOP:
        return
    program.process.send_signal(signal.SIGCONT)
    if program.ask("look") != "[]\n":
        found.wrong.append("the motion was to go on")


def put_away(before: Before) -> None:
    """Ends all processes that were stopped or left over."""

    def is_gone() -> bool:
        new = before.new()
        for pid in new:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return not new

    until(is_gone, "what was started does not end")


def stands_still(seconds: float) -> Round:
    """Checks that stopping a supervisor for `seconds` does no harm: its processes continue, and then so does the program."""
    found, before, plant = Round(f"process: the program is stopped for {seconds:g} s", None), Before(), Plant()
    program = Program(plant, process=True, if_cut_off="halt")
    try:
        plant.until_pushed()
        processors = program.pids("processor")
        program.process.send_signal(signal.SIGSTOP)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            state = plant.state()
            if state is None or state["is_safe"] or plant.speed(state) == 0.0:
                found.wrong.append(f"the plant does not move any more {seconds - end + time.monotonic():.1f} s after the stop")
                break
            time.sleep(0.1)
        program.process.send_signal(signal.SIGCONT)
        if program.ask("look") != "[]\n" or program.pids("processor") != processors:
            found.wrong.append("the motion was to go on, in the same process")
    except Exception as why:
        found.wrong.append(f"{type(why).__name__}: {why}")
    finally:
        program.end()
        put_away(before)
    return found


def rounds(count: int, seed: int, files: dict[int, Path] | None = None) -> Iterator[Round]:
    """Makes `count` attacks, every kind in turn."""
    every = attacks()
    for number in range(count):
        attack = every[number % len(every)]
        found, begun, safe = one(attack, random.Random(f"{seed} {number}"))
        late = [late_ns for _, at, late_ns in wakes.misses(files or {}) if late_ns > LATE_NS and at >= begun and at - late_ns <= safe]
        found.by_machine = bool(late)
        yield found


def spread(found: Iterable[Round], bound: str) -> str:
    """Returns the median, the 99th percentile and the maximum as text, ms."""
    times = sorted(one.safe_ms for one in found if one.bound == bound and one.safe_ms is not None)
    if not times:
        return "—"
    return f"{len(times):5} {statistics.median(times):8.2f} {times[min(len(times) - 1, int(0.99 * len(times)))]:8.2f} {times[-1]:8.2f}"


def table(found: list[Round]) -> str:
    """Returns the times after a death and a stop, of all attacks and of those in which the machine kept its period."""
    kept = [one for one in found if not one.by_machine]
    lines = [f"{'safe after, ms':40}{'n':>5} {'median':>8} {'p99':>8} {'max':>8}"]
    for bound in BOUND_MS:
        lines.append(f"{'a ' + bound + ', where the machine kept its period':40}{spread(kept, bound)}")
        lines.append(f"{'a ' + bound + ', all':40}{spread(found, bound)}")
        for name in sorted({one.attack for one in found if one.bound == bound}):
            lines.append(f"  {name:38}{spread([one for one in kept if one.attack == name], bound)}")
    return "\n".join(lines)


def too_late(found: list[Round]) -> list[str]:
    """Returns the bounds that the 99th percentile exceeds."""
    wrong = []
    for bound, limit_ms in BOUND_MS.items():
        times = sorted(one.safe_ms for one in found if one.bound == bound and one.safe_ms is not None and not one.by_machine)
        if times and times[min(len(times) - 1, int(0.99 * len(times)))] > limit_ms:
            wrong.append(f"a {bound}: the 99th percentile is {times[int(0.99 * len(times))]:.1f} ms instead of {limit_ms:g} ms")
    return wrong


def main() -> None:
    """Runs the campaign."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stands", type=float, default=STANDS_S, help="for how long the supervisor stands still, s")
    given = parser.parse_args()
    leftovers.enter_alone([__file__, *sys.argv[1:]])
    found: list[Round] = []
    with tempfile.TemporaryDirectory() as folder, wakes.measured(1_000_000, Path(folder)) as files, contextlib.suppress(KeyboardInterrupt):
        if given.stands:
            found.append(stands_still(given.stands))
        for one_round in rounds(given.count, given.seed, files):
            found.append(one_round)
            wrong = f"  {'; '.join(one_round.wrong)}" if one_round.wrong else ""
            if wrong or len(found) % 50 == 0:
                print(f"{len(found):5} {one_round.attack}{wrong}", flush=True)
    wrong = [f"{one.attack}: {what}" for one in found for what in one.wrong]
    print(table(found))
    print(f"{len(found)} attacks, {sum(one.by_machine for one in found)} in which the machine was late, {len(wrong)} that did not hold")
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps([asdict(one) for one in found], indent=1))
    for line in [*wrong, *too_late(found)]:
        print(line)
    sys.exit(1 if wrong or too_late(found) else 0)


if __name__ == "__main__":
    main()
