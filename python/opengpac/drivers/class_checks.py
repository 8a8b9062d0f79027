# SPDX-License-Identifier: Apache-2.0
"""Checks of a driver in Python on its class itself: values that reach `exchange`, and what many exchanges and lives leave behind.

The kit of the compiled core sees such a driver through the process that runs it, which holds back odd commands and restarts what leaks.
Here one process makes an object of the class and calls it directly. It prints one line of JSON for each check and ends at the first cause.
"""

from __future__ import annotations

import gc
import json
import math
import os
import sys
import tempfile
import threading
import time
import traceback
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..driver.base import channels_of, place_of
from ..driver.members import Channel
from ..driver.process import Exchange

SENTENCES = {
    "class-life": "its class opens, exchanges, goes to its safe state and closes",
    "class-readings": "readings keep their types and stay finite over many exchanges",
    "class-prints": "an exchange prints nothing",
    "class-counters": "its counters never fall",
    "class-values": "any command is refused, or leaves readings finite; afterwards the safe state comes about",
    "class-descriptors": "many exchanges and lives leave no descriptor behind",
    "class-threads": "many exchanges and lives leave no thread behind",
    "class-memory": "memory is flat over many exchanges",
}
EXCHANGES = 600
"""Of one run: more than the 200 after which a driver that counts its readings shows what it does then."""
BUSY_S = 5.0
"""A run of exchanges ends then, however many it has made: a slow device is tried less often."""
GROWTH_BYTES = 16.0
"""Bytes per exchange that may remain: less than one float in a list."""


class Wrong(Exception):
    """The cause of a check that failed."""


class Subject:
    """One object of the class, with room for its channels."""

    def __init__(self, options_json: str) -> None:
        self._exchange = Exchange(options_json)
        self.driver = self._exchange._driver
        channels = channels_of(type(self.driver))
        self.reads = [channel for channel in channels.values() if not channel.write]
        self.writes = [channel for channel in channels.values() if channel.write]
        offsets, ends = [], {False: 0, True: 0}
        for channel in channels.values():
            offsets.append(ends[channel.write])
            ends[channel.write] += channel.format.size
        self._exchange.place(offsets, ends[False])
        self.counted: list[int] = []

    def call(self, name: str) -> None:
        """Calls a method of its life. Wrong: it raises."""
        try:
            getattr(self._exchange, name)()
        except Exception as why:
            raise Wrong(f"{name}() raises {said(why)}") from why

    def exchange(self, value: Callable[[Channel], Any] = lambda channel: channel.initial) -> None:
        """Makes one exchange with these commands; what it raises is for the caller."""
        commands = b"".join(channel.pack(value(channel)) for channel in self.writes)
        self.counted = self._exchange.exchange(commands)[1]

    def steady(self, times: int) -> int:
        """Exchanges with the safe commands; how many it made within its time. Wrong: one raises, or a reading is not finite."""
        end_s = time.monotonic() + BUSY_S
        for number in range(1, times + 1):
            try:
                self.exchange()
            except Exception as why:
                raise Wrong(f"exchange() raises {said(why)} at exchange {number}, though nothing is commanded") from why
            if odd := self.odd():
                raise Wrong(f"reading '{odd.name}' is {self.value(odd)!r} after {number} exchanges")
            if time.monotonic() > end_s:
                return number
        return times

    def value(self, channel: Channel) -> Any:
        """Returns the value of a channel on the object."""
        values, name = place_of(self.driver, channel)
        return values[name]

    def odd(self) -> Channel | None:
        """Returns a channel whose reading is not finite."""
        values = ((channel, self.value(channel)) for channel in self.reads)
        flat = ((channel, one) for channel, value in values for one in (value if isinstance(value, (list, tuple)) else [value]))
        return next((channel for channel, one in flat if isinstance(one, float) and not math.isfinite(one)), None)


def said(why: BaseException) -> str:
    """Returns an exception in one line."""
    return f"{type(why).__name__}: {str(why).splitlines()[0] if str(why) else 'no text'}"


@contextmanager
def opened(options: str) -> Iterator[Subject]:
    """Yields an object that is open; it is made safe and closed behind the check."""
    subject = Subject(options)
    subject.call("open")
    try:
        yield subject
    finally:
        if not isinstance(sys.exc_info()[1], Wrong):
            subject.call("safe_state")
            subject.call("close")


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
            raise Wrong(f"it prints {size} bytes in {made} exchanges; write to a log when something changes")


def counters(options: str) -> None:
    with opened(options) as subject:
        names, before = subject._exchange._counters, [0] * len(subject._exchange._counters)
        end_s = time.monotonic() + BUSY_S
        for _ in range(EXCHANGES):
            subject.steady(1)
            raw = [subject.driver.__dict__[name] for name in names]
            for name, old, new in zip(names, before, raw, strict=True):
                if new < old or new < 0:
                    raise Wrong(f"counter '{name}' falls from {old} to {new}")
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
    """The value as this channel carries it; its safe value where its type has none such."""
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
                    # It is refused: the device is lost, and its safe state comes about all the same.
                    continue
                if odd := subject.odd():
                    made = f"makes reading '{odd.name}' {subject.value(odd)!r}"
                    raise Wrong(f"command '{channel.name}' that is {name} {made}; refuse it by raising")


def left(options: str, count: Callable[[], int], what: str) -> None:
    """Fails if there are more of something behind many exchanges, or behind some lives."""
    with opened(options) as subject:
        subject.steady(20)
        before = count()
        made = subject.steady(EXCHANGES)
        if count() - before > 2:
            raise Wrong(f"{made} exchanges leave {count() - before} {what} behind")
    lives, before = 5, count()
    for _ in range(lives):
        with opened(options) as subject:
            subject.steady(1)
        del subject
    gc.collect()
    if count() - before >= lives:
        raise Wrong(f"{lives} lives leave {count() - before} {what} behind: close() ends what open() begins")


def descriptors(options: str) -> None:
    left(options, lambda: len(os.listdir("/proc/self/fd")), "descriptors")


def threads(options: str) -> None:
    left(options, threading.active_count, "threads")


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
        # What fills up and is full stops growing.
        if min(grown) > GROWTH_BYTES:
            raise Wrong(f"each exchange leaves {min(grown):.0f} bytes behind")


CHECKS: dict[str, Callable[[str], None]] = {
    "class-life": life, "class-readings": readings, "class-prints": prints, "class-counters": counters, "class-values": values,
    "class-descriptors": descriptors, "class-threads": threads, "class-memory": memory,
}  # fmt: skip


def main() -> int:
    """Checks the class that standard input describes; each outcome is a line of JSON on the descriptor that standard output was."""
    options = sys.stdin.read()
    # What the driver prints is no outcome.
    told = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for name, check in CHECKS.items():
        why = ""
        try:
            check(options)
        except Wrong as wrong:
            why = str(wrong)
        except Exception as raised:
            traceback.print_exc()
            why = f"it raises {said(raised)}"
        verdict = "failed" if why else "passed"
        print(json.dumps({"check": name, "sentence": SENTENCES[name], "verdict": verdict, "why": why}), file=told, flush=True)
        if why:
            break
    told.flush()
    # Threads that a driver has left behind keep nobody waiting.
    os._exit(0)


if __name__ == "__main__":
    main()
