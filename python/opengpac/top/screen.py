# SPDX-License-Identifier: Apache-2.0
"""Live screen of `opengpac top`: handles keys while it waits for the next snapshot."""

from __future__ import annotations

import os
import select
import sys
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from .board import ORDERS, View, board
from .look import Look, Watch

_KEYS = "q quit   s sort   p pause   f filter"
_ESCAPE, _RETURN, _RUB = "\x1b", ("\r", "\n"), ("\x7f", "\b")


@contextmanager
def keys() -> Iterator[None]:
    """Makes the terminal deliver every key immediately and without echo; restores it on exit."""
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


class Screen:
    """Screen with the tables of a system, redrawn at each snapshot, at each key press, and when the window size changes."""

    def __init__(self, watch: Watch, view: View, system: str) -> None:
        self._watch = watch
        self._view = view
        self._system = system
        self._paused = False
        self._typing = False
        self._looks: tuple[Look, Look | None] = watch.look()

    def run(self) -> None:
        """Runs until `q` or Ctrl-C."""
        console = Console()
        with keys(), Live(console=console, screen=True, auto_refresh=False, vertical_overflow="crop") as live:
            while True:
                self._draw(console, live)
                next_s = time.monotonic() + self._watch.every_s
                while (left_s := next_s - time.monotonic()) > 0:
                    # A window resize interrupts nothing, so check for it regularly.
                    for key in self._pressed(min(left_s, 0.25)):
                        if not self.take(key):
                            return
                    self._draw(console, live)
                if not self._paused:
                    self._looks = self._watch.look()

    def _pressed(self, within_s: float) -> str:
        ready, _, _ = select.select([sys.stdin], [], [], within_s)
        if not ready:
            return ""
        read = os.read(sys.stdin.fileno(), 64)
        # A closed terminal counts as the end.
        return read.decode(errors="ignore") if read else "q"

    def take(self, key: str) -> bool:
        """Handles a key; returns False if it is the key to quit."""
        if self._typing:
            self._type(key)
        elif key == "q":
            return False
        elif key == "s":
            self._view.sort = ORDERS[(ORDERS.index(self._view.sort) + 1) % len(ORDERS)]
        elif key == "p":
            self._paused = not self._paused
        elif key == "f":
            self._typing, self._view.filter = True, ""
        return True

    def _type(self, key: str) -> None:
        if key in _RETURN:
            self._typing = False
        elif key == _ESCAPE:
            self._typing, self._view.filter = False, ""
        elif key in _RUB:
            self._view.filter = self._view.filter[:-1]
        elif key.isprintable():
            self._view.filter += key

    def _draw(self, console: Console, live: Live) -> None:
        self._view.rows = console.height - 2
        live.update(self.drawn(), refresh=True)

    def drawn(self) -> Any:
        """Renders the contents of the whole screen."""
        words = [f" {self._system} ", _KEYS]
        words += [f"filter: {self._view.filter}{'_' if self._typing else ''}"] if self._typing or self._view.filter else []
        words += ["paused"] if self._paused else []
        return Group(Text("   ".join(words), style="reverse"), board(*self._looks, self._view).__rich__())
