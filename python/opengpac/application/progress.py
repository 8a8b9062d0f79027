# SPDX-License-Identifier: Apache-2.0
"""Progress line while a program waits in a terminal: the verb, its command list, and the elapsed time."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from ..errors import refusals

if TYPE_CHECKING:
    from .instances import VerbInstance

SLICE_NS = 100_000_000
"""Interval at which the line is updated, on the system's clock."""


def wanted(asked: bool | None) -> bool:
    """Returns whether to show progress: as set in the system, otherwise as set by `OPENGPAC_PROGRESS`, otherwise only in a terminal."""
    if asked is not None:
        return asked
    told = os.environ.get("OPENGPAC_PROGRESS")
    return told not in ("", "0") if told is not None else sys.stderr.isatty()


class Line:
    """Progress line of a wait that has lasted at least one slice; `clear` removes it."""

    def __init__(self, instance: VerbInstance[Any]) -> None:
        self._instance = instance
        with refusals:
            self._began_ns = instance.system._native.now() - SLICE_NS
        self._width = 0

    def show(self) -> None:
        """Redraws the line."""
        native = self._instance.system._native
        with refusals:
            about = native.instance(self._instance.identity)
            elapsed_s = (native.now() - self._began_ns) * 1e-9
        text = f"{about['name']}: {about.get('list') or about['state']}, {elapsed_s:.1f} s"
        self._write(text)

    def clear(self) -> None:
        """Clears the line."""
        if self._width:
            self._write("")
            sys.stderr.write("\r")
            sys.stderr.flush()

    def _write(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)
