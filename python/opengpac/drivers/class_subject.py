# SPDX-License-Identifier: Apache-2.0
"""Object of a driver's class under test, and the failures that the checks find."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..driver.base import channels_of, place_of
from ..driver.members import Channel
from ..driver.process import Exchange

BUSY_S = 5.0
"""Time limit of a run of exchanges, in s; with a slow device, fewer exchanges are made."""


class Wrong(Exception):
    """Reason for a failed check."""


class Subject:
    """One object of the class under test, with buffers for its channels."""

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
        """Calls a method of the object's life cycle. Raises `Wrong` if the method raises an exception."""
        try:
            getattr(self._exchange, name)()
        except (Exception, SystemExit) as why:
            raise Wrong(f"{name}() raises {said(why)}") from why

    def exchange(self, value: Callable[[Channel], Any] = lambda channel: channel.initial, engaged: bytes = b"") -> None:
        """Performs one exchange with the commands that `value` returns; exceptions propagate. `engaged` is as in `Exchange.exchange`."""
        commands = b"".join(channel.pack(value(channel)) for channel in self.writes)
        self.counted = self._exchange.exchange(commands, engaged)[1]

    def steady(self, times: int) -> int:
        """Exchanges with the safe commands; returns the number of exchanges made within the time limit. Raises `Wrong` if an exchange
        raises an exception or a reading is not finite."""
        end_s = time.monotonic() + BUSY_S
        for number in range(1, times + 1):
            try:
                self.exchange()
            except (Exception, SystemExit) as why:
                raise Wrong(f"exchange() raises {said(why)} at exchange {number}, although nothing is commanded") from why
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
        """Returns a channel whose reading is not finite, or None."""
        values = ((channel, self.value(channel)) for channel in self.reads)
        flat = ((channel, one) for channel, value in values for one in (value if isinstance(value, (list, tuple)) else [value]))
        return next((channel for channel, one in flat if isinstance(one, float) and not math.isfinite(one)), None)


def said(why: BaseException) -> str:
    """Returns the text of an exception as one line."""
    return f"{type(why).__name__}: {str(why).splitlines()[0] if str(why) else 'no text'}"


@contextmanager
def opened(options: str) -> Iterator[Subject]:
    """Yields an open object; brings it to its safe state and closes it after the check."""
    subject = Subject(options)
    subject.call("open")
    try:
        yield subject
    finally:
        if not isinstance(sys.exc_info()[1], Wrong):
            subject.call("safe_state")
            subject.call("close")
