# SPDX-License-Identifier: Apache-2.0
"""Test device that communicates in lines of text, over TCP or a pseudo-terminal."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self

from .ends import SerialEnd, TcpEnd


class Text:
    """A device that communicates in lines of text; `address` is for `gpac.drivers.text`."""

    def __init__(self, answers: Mapping[str, str], end: str, serial: bool) -> None:
        self.answers = dict(answers)
        """Answer to each text that the device recognises."""
        self._marks = end
        self._heard: list[str] = []
        self._lock = threading.Lock()
        self._end: TcpEnd | SerialEnd = SerialEnd(self._receive) if serial else TcpEnd(self._receive)
        self.address: str = f"serial/{self._end.path}" if isinstance(self._end, SerialEnd) else f"tcp/127.0.0.1:{self._end.port}"

    @property
    def heard(self) -> list[str]:
        """Received texts, without the terminator."""
        with self._lock:
            return list(self._heard)

    @property
    def connected(self) -> int:
        """Number of connected clients; always 1 for a serial line."""
        return self._end.connected

    def say(self, text: str) -> None:
        """Sends an unsolicited `text` to all clients, with the terminator."""
        self._end.send((text + self._marks).encode("latin-1"))

    def start(self) -> Self:
        """Switches the device on."""
        self._end.start()
        return self

    def stop(self) -> None:
        """Switches the device off; `start` switches it on again."""
        self._end.stop()

    def close(self) -> None:
        """Closes the device, like the end of the `with` block."""
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
    """Creates a device that communicates in lines of text, for a test: `with gpac.drivers.fake.text(answers={"P": "ST,12.5 kg"}) as
    scale: …`.

    It answers according to `answers`; `say()` sends unsolicited texts, and `heard` contains the received texts. Each text ends with
    `end`. It uses a TCP port of this host, or, with `serial=True`, a pseudo-terminal. `stop()` and `start()` switch it off and on.
    """
    return Text(answers or {}, end, serial)
