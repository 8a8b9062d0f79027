# SPDX-License-Identifier: Apache-2.0
"""A reader of a scope: receives every value of an SVV that counts up by 1, over the control interface."""

from __future__ import annotations

import struct
import sys
import threading
from pathlib import Path
from typing import Self

import numpy as np

import opengpac as gpac
from opengpac.studio import server

sys.path.append(str(Path(__file__).parent.parent / "python"))
from browser import Browser, Stream


class Scope:
    """Reader of the chain's number over the control interface, on a thread of its own."""

    def __init__(self, cell: gpac.System, folder: Path) -> None:
        (folder / "index.html").write_text("<!doctype html><title>soak</title>\n")
        self._served = server.serve(cell, 0, "observe", None, folder)
        self._stream: Stream = Browser(self._served.url).stream()
        self._stream.say(subscribe="scope", id="soak", names=["sent"], every_ms=50)
        self.frames = self.values = self.lost = self.missing = 0
        self._last: float | None = None
        self._ending = False
        self.failure: str | None = None
        self._thread = threading.Thread(target=self._read, name="soak-scope")
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._ending = True
        self._served.stop()
        self._thread.join()
        self._stream.close()

    def _read(self) -> None:
        try:
            while True:
                frame = self._stream.next()
                if isinstance(frame, bytes):
                    self._take(frame)
                elif "errors" in frame:
                    self.failure = str(frame)
        except (AssertionError, OSError) as why:
            if not self._ending:
                self.failure = f"the scope's stream ended: {why}"

    def _take(self, frame: bytes) -> None:
        _, id_length = struct.unpack_from("<II", frame)
        at = 8 + (id_length + 7) // 8 * 8
        (runs, _), at = struct.unpack_from("<II", frame, at), at + 8
        self.frames += 1
        for _ in range(runs):
            (_, count, lost), at = struct.unpack_from("<IIQ", frame, at), at + 16
            at += 16 * count
            values, at = np.frombuffer(frame, "<f8", count, at), at + 8 * count
            self.lost += lost
            self.values += count
            if count:
                whole = values if self._last is None else np.concatenate([[self._last], values])
                self.missing += int((np.diff(whole) - 1).sum()) - (lost if self._last is not None else 0)
                self._last = float(values[-1])
