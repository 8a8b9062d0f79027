# SPDX-License-Identifier: Apache-2.0
"""Checks that call the class of a driver in Python directly, for the values that reach `exchange`, and for leaks over many exchanges and
life cycles.

The test kit of the compiled core sees such a driver only through its process, which filters invalid commands, and hides leaks by
restarting. Here, one process creates an object of the class and calls it directly. It prints one line of JSON for each check, and
stops at the first failure.
"""

from __future__ import annotations

import gc
import json
import math
import os
import signal
import sys
import tempfile
import threading
import time
import traceback
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..driver.members import Channel
from .class_parts import parts
from .class_subject import BUSY_S, Subject, Wrong, opened, said

SENTENCES = {
    "class-life": "the class opens, exchanges, goes to its safe state and closes",
    "class-readings": "readings keep their types and stay finite over many exchanges",
    "class-prints": "an exchange prints nothing",
    "class-brief": "an exchange takes less than 5 ms of computing time",
    "class-kept": "no call changes the working directory, the environment, the file mask or a signal handler of the process",
    "class-counters": "counters never decrease",
    "class-values": "any command is refused or leaves readings finite, and the safe state is reached afterwards",
    "class-parts": "a part rests without commands and follows commands, and its velocity has the sign of its motion",
    "class-descriptors": "repeated exchanges and restarts leak no file descriptor",
    "class-threads": "repeated exchanges and restarts leak no thread",
    "class-processes": "repeated exchanges and restarts leave no process behind",
    "class-memory": "memory use stays constant over many exchanges",
}
EXCHANGES = 600
"""Number of exchanges in one run. Exceeds 200, because a driver that counts its readings may change its behaviour at that number."""
BRIEF_S = 0.005
"""Maximum average processor time of one exchange, s: half the budget of a driver at 100 Hz."""
GROWTH_BYTES = 16.0
"""Maximum number of leaked bytes per exchange: less than one float in a list."""


def life(options: str) -> None:
    with opened(options) as subject:
        subject.steady(3)
        subject.call("safe_state")
        subject.steady(3)


def readings(options: str) -> None:
    with opened(options) as subject:
        subject.steady(EXCHANGES)


def prints(options: str) -> None:
    with opened(options) as subject, tempfile.TemporaryFile() as file:
        subject.steady(2)
        sys.stdout.flush()
        kept = [os.dup(1), os.dup(2)]
        for name in (1, 2):
            os.dup2(file.fileno(), name)
        try:
            made = subject.steady(20)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            for name, descriptor in zip((1, 2), kept, strict=True):
                os.dup2(descriptor, name)
                os.close(descriptor)
        size = os.fstat(file.fileno()).st_size
        if size >= made:
            raise Wrong(f"it prints {size} bytes in {made} exchanges; write to a log instead, and only on changes")


def brief(options: str) -> None:
    with opened(options) as subject:
        subject.steady(2)
        before = time.thread_time()
        made = subject.steady(20)
        mean = (time.thread_time() - before) / made
        if mean > BRIEF_S:
            raise Wrong(f"it takes {mean * 1e3:.1f} ms of computing time; wait for the machine with a blocking call instead of a loop")


AT_FIRST: dict[str, Any] = {}
"""Initial state of this process, before any code of the driver has run."""


def shared() -> dict[str, Any]:
    """Returns the process-wide state on which other code relies, by name of the aspect."""
    mask = os.umask(0)
    os.umask(mask)
    handlers = {each.name: signal.getsignal(each) for each in signal.Signals}
    return {"the working directory": os.getcwd(), "the environment": dict(os.environ), "the file mask": mask, "a signal handler": handlers}


def restore(found: dict[str, Any]) -> None:
    """Restores the initial state of this process, which an earlier check may have changed."""
    os.chdir(found["the working directory"])
    os.umask(found["the file mask"])
    os.environ.clear()
    os.environ.update(found["the environment"])
    for name, handler in found["a signal handler"].items():
        if signal.getsignal(signal.Signals[name]) != handler:
            signal.signal(signal.Signals[name], handler)


def kept(options: str) -> None:
    restore(AT_FIRST)
    with opened(options) as subject:
        same("open()")
        subject.steady(3)
        same("exchange()")
        subject.call("safe_state")
        same("safe_state()")
    same("close()")


def same(call: str) -> None:
    """Fails if a call has changed the initial state of this process."""
    for what, now in shared().items():
        if now != AT_FIRST[what]:
            raise Wrong(f"{call} changes {what} of its process, which is the program's own under the virtual clock")


def counters(options: str) -> None:
    with opened(options) as subject:
        names, before = subject._exchange._counters, [0] * len(subject._exchange._counters)
        end_s = time.monotonic() + BUSY_S
        for _ in range(EXCHANGES):
            subject.steady(1)
            raw = [subject.driver.__dict__[name] for name in names]
            for name, old, new in zip(names, before, raw, strict=True):
                if new < old or new < 0:
                    raise Wrong(f"counter '{name}' decreases from {old} to {new}")
            before = raw
            if time.monotonic() > end_s:
                return


VALUES: dict[str, Callable[[bool], Any]] = {
    "not a number": lambda is_float: math.nan if is_float else None,
    "infinite": lambda is_float: math.inf if is_float else None,
    "minus infinite": lambda is_float: -math.inf if is_float else None,
    "the largest number": lambda is_float: 3.4e38 if is_float else "max",
    "the lowest number": lambda is_float: -3.4e38 if is_float else "min",
    "1": lambda is_float: 1.0 if is_float else 1,
    "-1": lambda is_float: -1.0 if is_float else "min",
}


def commanded(channel: Channel, of: Callable[[bool], Any]) -> Any:
    """Converts the value to the channel's type, or returns the channel's safe value if the type cannot represent it."""
    number = channel.type.partition("[")[0]
    value = of(number in ("float", "double"))
    if number == "bool":
        value = value == 1
    elif value is None:
        return channel.initial
    elif isinstance(value, str):
        bits, is_signed = 8 * channel.format.size // (channel.elements or 1), not number.startswith("u")
        value = {"max": 2 ** (bits - is_signed) - 1, "min": -(2 ** (bits - 1)) if is_signed else 0}[value]
    return value if channel.elements is None else [value] * channel.elements


def values(options: str) -> None:
    for name, of in VALUES.items():
        for channel in Subject(options).writes:
            with opened(options) as subject:
                subject.steady(2)
                try:
                    for _ in range(3):
                        subject.exchange(lambda each, of=of, one=channel.name: commanded(each, of) if each.name == one else each.initial)
                except Exception:
                    # The command is refused: the device is lost, and its safe state is entered all the same.
                    continue
                if odd := subject.odd():
                    made = f"sets reading '{odd.name}' to {subject.value(odd)!r}"
                    raise Wrong(f"a command '{channel.name}' that is {name} {made}; refuse it by raising an exception")


def left(options: str, count: Callable[[], int], what: str) -> None:
    """Fails if the count grows over many exchanges or over several life cycles."""
    with opened(options) as subject:
        subject.steady(20)
        before = count()
        made = subject.steady(EXCHANGES)
        if count() - before > 2:
            raise Wrong(f"{made} exchanges leak {count() - before} {what}")
    lives, before = 5, count()
    for _ in range(lives):
        with opened(options) as subject:
            subject.steady(1)
        del subject
    gc.collect()
    if count() - before >= lives:
        raise Wrong(f"{lives} restarts leak {count() - before} {what}; release in close() what open() acquires")


def descriptors(options: str) -> None:
    left(options, lambda: len(os.listdir("/proc/self/fd")), "descriptors")


def threads(options: str) -> None:
    left(options, threading.active_count, "threads")


def children() -> int:
    """Returns the number of unreaped child processes of this process."""
    found = 0
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            # After the name, which may contain any character: state, parent.
            behind = Path("/proc", name, "stat").read_text().rpartition(")")[2]
        except OSError:
            continue
        found += int(behind.split()[1]) == os.getpid()
    return found


def processes(options: str) -> None:
    left(options, children, "processes")


def memory(options: str) -> None:
    with opened(options) as subject:
        subject.steady(EXCHANGES)
        tracemalloc.start()
        grown = []
        for _ in range(2):
            gc.collect()
            before = tracemalloc.get_traced_memory()[0]
            made = subject.steady(EXCHANGES)
            gc.collect()
            grown.append((tracemalloc.get_traced_memory()[0] - before) / made)
        tracemalloc.stop()
        # Bounded buffers stop growing once they are full.
        if min(grown) > GROWTH_BYTES:
            raise Wrong(f"each exchange leaks {min(grown):.0f} bytes")


CHECKS: dict[str, Callable[[str], None]] = {
    "class-life": life, "class-readings": readings, "class-prints": prints, "class-brief": brief, "class-kept": kept,
    "class-counters": counters, "class-values": values, "class-parts": parts, "class-descriptors": descriptors,
    "class-threads": threads, "class-processes": processes, "class-memory": memory,
}  # fmt: skip


def main() -> int:
    """Checks the class described on standard input; prints each outcome as a line of JSON to the original standard output."""
    options = sys.stdin.read()
    AT_FIRST.update(shared())
    # Output printed by the driver is not an outcome.
    told = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for name, check in CHECKS.items():
        why = ""
        try:
            check(options)
        except Wrong as wrong:
            why = str(wrong)
        except (Exception, SystemExit) as raised:
            traceback.print_exc()
            why = f"it raises {said(raised)}"
        verdict = "failed" if why else "passed"
        print(json.dumps({"check": name, "sentence": SENTENCES[name], "verdict": verdict, "why": why}), file=told, flush=True)
        if why:
            break
    told.flush()
    # Exit without waiting for threads that a driver has left behind.
    os._exit(0)


if __name__ == "__main__":
    main()
