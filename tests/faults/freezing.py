# SPDX-License-Identifier: Apache-2.0
"""Freezes a machine that moves, whole: a daemon, its program, processors, plants and guards, or two hosts with all of theirs, for a while.

    python tests/faults/freezing.py               each place, each way, 0.3 s, 2 s and 20 s
    python tests/faults/freezing.py --times 5     more often

Every process is stopped (SIGSTOP), or all of them at once by the freezer of a control group, where this user may use one. Afterwards the
speed that was asked for is kept, what the freeze led to is what docs/motion.md says, its length is told, and nobody is blamed: no process
is ended or replaced, no processor, host, session or guard is lost. The report is in `out/freezing.json`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import leftovers
from apart import Daemon, daemon
from freezing_program import ASKED
from leftovers import Before, command_of
from plant import until

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "freezing.json"
PLACES = ("threads of a daemon", "a process of a daemon", "two hosts")
WAYS = ("stop", "freezer")
SPANS_S = (0.3, 2.0, 20.0)
HARDLY_LATE = 1.3
"""Share of the speed at which a servo makes up for set-points that are late by up to their period, as under load: 1.15 for one, more for
several in a row (docs/motion.md). What is caught up with otherwise goes at many times the speed."""
MAX_GAP_S, LOST_AFTER_S = 0.5, 2.0
"""Bounds of a joint and of an output that nobody attends to, docs/motion.md."""
BLAME = re.compile(
    r"processor_lost|one of its two processes|no guard|was ended|is gone|has exited|no longer answers|cut off|lost its|host '.*' (is|was) l"
    r"|did not answer|no longer (fired|a guard)"
)
"""Words of the log and of alarms by which somebody would be blamed."""


@dataclass
class Freeze:
    """What one freeze led to."""

    place: str
    way: str
    span_s: float
    lasted_s: float = 0.0
    ended: list[str] = field(default_factory=list)
    speed: float = 0.0
    wrong: list[str] = field(default_factory=list)


class Program:
    """The program that commands, and what belongs to it."""

    def __init__(self, url: str | None, endpoint: str | None, *, process: bool) -> None:
        told = {"url": url, "endpoint": endpoint, "process": process, "plant": f"freezing-{secrets.token_hex(6)}"}
        command = [sys.executable, str(HERE / "freezing_program.py"), json.dumps(told)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def line(self) -> str:
        """The next thing that it says."""
        assert self.process.stdout
        return self.process.stdout.readline()

    def ask(self, what: str) -> Any:
        """Its answer."""
        assert self.process.stdin
        self.process.stdin.write(f"{what}\n")
        self.process.stdin.flush()
        return json.loads(self.line())

    def end(self) -> None:
        """Ends it, in order where it still can."""
        try:
            self.process.communicate("close\n", timeout=60)
        except (subprocess.TimeoutExpired, BrokenPipeError, ValueError):
            self.process.kill()
            self.process.communicate()


@contextlib.contextmanager
def placed(place: str) -> Iterator[tuple[Program, list[int]]]:
    """The program of a place, whose joint moves, and the processes that stand at the top of what there is."""
    with contextlib.ExitStack() as left:
        if place == "two hosts":
            endpoint = f"tcp/127.0.0.1:{_port()}"
            program = Program(None, endpoint, process=False)
            left.callback(program.end)
            words = ["join", "--system", "frozen", "--at", endpoint, "--name", "cell-b"]
            joined = subprocess.Popen([sys.executable, "-m", "opengpac", *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            left.callback(lambda: (joined.kill(), joined.wait()))
            tops = [program.process.pid, joined.pid]
        else:
            served: Daemon = left.enter_context(daemon())
            program = Program(served.url, None, process=place == "a process of a daemon")
            left.callback(program.end)
            tops = [served.process.pid, program.process.pid]
        assert program.line() == "ready\n"
        yield program, tops


def _port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def trees(tops: Sequence[int]) -> list[int]:
    """These processes with all that they have started, directly or not."""
    found = list(tops)
    for pid in found:
        with contextlib.suppress(OSError):
            for thread in (Path("/proc") / str(pid) / "task").iterdir():
                found += [int(child) for child in (thread / "children").read_text().split() if int(child) not in found]
    return found


class Stopped:
    """Every process of a set is stopped, one after the other."""

    def __init__(self, pids: Sequence[int]) -> None:
        self.pids = pids

    def freeze(self) -> None:
        """Nothing of it runs when this returns."""
        for pid in self.pids:
            os.kill(pid, signal.SIGSTOP)

    def thaw(self) -> None:
        """It goes on."""
        for pid in self.pids:
            os.kill(pid, signal.SIGCONT)

    def put_away(self) -> None:
        """Nothing is left of it."""


class Frozen:
    """A control group whose processes the operating system freezes together."""

    def __init__(self, pids: Sequence[int]) -> None:
        folder = next(folder for folder in (Path("/sys/fs/cgroup/freezer"), Path("/sys/fs/cgroup")) if folder.is_dir())
        self.group = folder / f"opengpac-{secrets.token_hex(6)}"
        self.group.mkdir()
        self.is_old = (self.group / "freezer.state").exists()
        self.home = folder / "cgroup.procs"
        self.pids = pids
        for pid in pids:
            (self.group / "cgroup.procs").write_text(str(pid))

    def _is(self, frozen: bool) -> bool:
        if self.is_old:
            return (self.group / "freezer.state").read_text().strip() == ("FROZEN" if frozen else "THAWED")
        return f"frozen {int(frozen)}" in (self.group / "cgroup.events").read_text()

    def _set(self, frozen: bool) -> None:
        file, words = ("freezer.state", ("THAWED", "FROZEN")) if self.is_old else ("cgroup.freeze", ("0", "1"))
        (self.group / file).write_text(words[frozen])
        until(lambda: self._is(frozen), "the group does not freeze or thaw")

    def freeze(self) -> None:
        """Nothing of it runs when this returns."""
        self._set(True)

    def thaw(self) -> None:
        """It goes on."""
        self._set(False)

    def put_away(self) -> None:
        """The group is gone."""

        def is_gone() -> bool:
            for pid in (self.group / "cgroup.procs").read_text().split():
                with contextlib.suppress(OSError):
                    self.home.write_text(pid)
            with contextlib.suppress(OSError):
                self.group.rmdir()
            return not self.group.exists()

        until(is_gone, "the group does not go")


def may_freeze() -> bool:
    """Whether this user may use the freezer of a control group."""
    try:
        Frozen([]).put_away()
    except (OSError, StopIteration):
        return False
    return True


def one(place: str, way: str, span_s: float) -> Freeze:
    """Makes one freeze; what followed."""
    found, before = Freeze(place, way, span_s), Before()
    try:
        with placed(place) as (program, tops):
            there = sorted(trees(tops))
            held = (Stopped if way == "stop" else Frozen)(there)
            try:
                begun = time.monotonic()
                held.freeze()
                frozen = time.monotonic()
                time.sleep(span_s)
                least_s = time.monotonic() - frozen
                held.thaw()
                found.lasted_s = time.monotonic() - begun
                judge(found, program, least_s, tops, there)
            finally:
                held.put_away()
    except Exception as why:
        found.wrong.append(f"{type(why).__name__}: {why}")
    found.wrong += before.left_over()
    return found


def changed(tops: Sequence[int], there: Sequence[int]) -> str:
    """Which processes came and went, for people."""
    now = trees(tops)
    return f"gone {[pid for pid in there if pid not in now]}, come {[command_of(pid)[-60:] for pid in now if pid not in there]}"


def judge(found: Freeze, program: Program, least_s: float, tops: Sequence[int], there: Sequence[int]) -> None:
    """What it led to: what must be, by how long it was."""
    goes_on = least_s < MAX_GAP_S and found.lasted_s < MAX_GAP_S
    found.ended = program.ask("look" if goes_on else "end")
    alarms, log = program.ask("told")
    found.speed = program.ask("speed")
    if found.speed > ASKED * HARDLY_LATE:
        found.wrong.append(f"the joint was commanded at {found.speed:.4f} rad/s, {ASKED} rad/s were asked for")
    expected = _expected(found.lasted_s, least_s)
    if found.place == "two hosts" and found.lasted_s > LOST_AFTER_S:
        # The generator runs on the other host, and may end its motion before the loss of the device does.
        expected.add("time_lost")
    condition = found.ended[0] if found.ended else ""
    if condition not in expected:
        found.wrong.append(f"the motion ended with {found.ended}, and was to end with one of {sorted(expected)}")
    if condition:
        said = " ".join([found.ended[1], *alarms.values()])
        told_s = [float(word) for word in re.findall(r"(\d+(?:\.\d+)?) s (?:were lost|\()", said)]
        if not any(least_s - 0.1 <= length <= found.lasted_s + 2.0 for length in told_s):
            found.wrong.append(f"the length of the freeze ({found.lasted_s:.2f} s) is not told: {found.ended[1]}, {alarms}")
    texts = [*(f"{code}: {text}" for code, text in alarms.items()), *(f"{kind}: {text}" for kind, text in log if kind != "command")]
    found.wrong += [f"blame: {text}" for text in texts if BLAME.search(text)]
    until(lambda: sorted(trees(tops)) == there, f"somebody was ended or replaced: {changed(tops, there)}")
    if not goes_on and (again := program.ask("again")) != ["arrived", ""]:
        found.wrong.append(f"the joint does not move again after reset() and enable(): {again}")


def _expected(lasted_s: float, least_s: float) -> set[str]:
    """What the motion may end with; empty where it goes on. At a bound either side of it counts."""
    expected = set()
    if least_s < MAX_GAP_S:
        expected.add("")
    if lasted_s > MAX_GAP_S and least_s < LOST_AFTER_S + 0.1:
        expected.add("time_lost")
    if lasted_s > LOST_AFTER_S:
        expected.add("device_lost")
    return expected


def table(found: Sequence[Freeze]) -> str:
    """A line each."""
    lines = [f"{'place':24}{'way':10}{'asked, s':>9}{'lasted, s':>10}  {'ended with':14}{'speed, rad/s':>13}  wrong"]
    for of in found:
        ended = of.ended[0] if of.ended else "goes on"
        lines.append(f"{of.place:24}{of.way:10}{of.span_s:9g}{of.lasted_s:10.2f}  {ended:14}{of.speed:13.4f}  {'; '.join(of.wrong)}")
    return "\n".join(lines)


def main() -> None:
    """All of them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--times", type=int, default=1)
    parser.add_argument("--spans", type=lambda text: [float(s) for s in text.split(",")], default=list(SPANS_S))
    given = parser.parse_args()
    ways = WAYS if may_freeze() else WAYS[:1]
    leftovers.enter_alone([__file__, *sys.argv[1:]])
    found: list[Freeze] = []
    with contextlib.suppress(KeyboardInterrupt):
        for _ in range(given.times):
            for place in PLACES:
                for way in ways:
                    for span_s in given.spans:
                        found.append(one(place, way, span_s))
                        print(table(found).splitlines()[-1], flush=True)
    print(table(found))
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps([asdict(of) for of in found], indent=1))
    sys.exit(1 if any(of.wrong for of in found) else 0)


if __name__ == "__main__":
    main()
