# SPDX-License-Identifier: Apache-2.0
"""A device that speaks in lines of text, for tests: over TCP or a pseudo terminal."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self

from .ends import SerialEnd, TcpEnd


class Text:
    """A device that speaks in texts; `address` is for `gpac.drivers.text`."""

    def __init__(self, answers: Mapping[str, str], end: str, serial: bool) -> None:
        self.answers = dict(answers)
        """What it answers to which text."""
        self._marks = end
        self._heard: list[str] = []
        self._lock = threading.Lock()
        self._end: TcpEnd | SerialEnd = SerialEnd(self._receive) if serial else TcpEnd(self._receive)
        self.address: str = f"serial/{self._end.path}" if isinstance(self._end, SerialEnd) else f"tcp/127.0.0.1:{self._end.port}"

    @property
    def heard(self) -> list[str]:
        """The texts that it was sent, without their end."""
        with self._lock:
            return list(self._heard)

    @property
    def connected(self) -> int:
        """Number of connected clients; a serial line does not tell, and says 1."""
        return self._end.connected

    def say(self, text: str) -> None:
        """Says a text by itself, to all connections; its end is added."""
        self._end.send((text + self._marks).encode("latin-1"))

    def start(self) -> Self:
        """Starts to listen."""
        self._end.start()
        return self

    def stop(self) -> None:
        """Switches it off; `start` switches it on again."""
        self._end.stop()

    def close(self) -> None:
        """Ends it, as the with-statement does."""
        self._end.close()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _receive(self, came: bytearray, send: Callable[[bytes], None]) -> None:
        mark = self._marks.encode("latin-1")
        while mark in came:
            line, _, rest = bytes(came).partition(mark)
            came[:] = rest
            text = line.decode("latin-1")
            with self._lock:
                self._heard.append(text)
            if text in self.answers:
                send((self.answers[text] + self._marks).encode("latin-1"))


def text(*, answers: Mapping[str, str] | None = None, end: str = "\n", serial: bool = False) -> Text:
    """A device that speaks in texts, for a test: `with gpac.drivers.fake.text(answers={"P": "ST,12.5 kg"}) as scale: …`.

    It answers as `answers` say, `say()` makes it speak by itself, and `heard` is what it was sent. Each text ends with `end`. Over TCP on
    a port of this host, or `serial=True` on a pseudo terminal. `stop()` and `start()` are its switch.
    """
    return Text(answers or {}, end, serial)
