# SPDX-License-Identifier: Apache-2.0
"""One line of progress while a program waits in a terminal: the verb, its command list, how long it has run."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from ..errors import refusals

if TYPE_CHECKING:
    from .instances import VerbInstance

SLICE_NS = 100_000_000
"""How often the line is written, on the system's clock."""


def wanted(asked: bool | None) -> bool:
    """Returns whether to show it: as the system was told, else by `OPENGPAC_PROGRESS`, else in a terminal only."""
    if asked is not None:
        return asked
    told = os.environ.get("OPENGPAC_PROGRESS")
    return told not in ("", "0") if told is not None else sys.stderr.isatty()


class Line:
    """The line, of a wait that has lasted one slice; `clear` takes it away."""

    def __init__(self, instance: VerbInstance[Any]) -> None:
        self._instance = instance
        with refusals:
            self._began_ns = instance.system._native.now() - SLICE_NS
        self._width = 0

    def show(self) -> None:
        """Writes it over the last one."""
        native = self._instance.system._native
        with refusals:
            about = native.instance(self._instance.identity)
            elapsed_s = (native.now() - self._began_ns) * 1e-9
        text = f"{about['name']}: {about.get('list') or about['state']}, {elapsed_s:.1f} s"
        self._write(text)

    def clear(self) -> None:
        """Leaves an empty line."""
        if self._width:
            self._write("")
            sys.stderr.write("\r")
            sys.stderr.flush()

    def _write(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)
