# SPDX-License-Identifier: Apache-2.0
"""Lines of the table, and their printing."""

from __future__ import annotations

import shutil
import statistics
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any


@dataclass
class Line:
    """Measurement: `value` is judged against `bar` (the maximum; with `at_least` the minimum), `shown` is its text.

    `open` is the reason why its bar is not met yet; until then it may be missed.
    """

    row: str
    what: str
    ours: str = ""
    peer: str = ""
    value: float | None = None
    shown: str = ""
    bar: float | None = None
    bar_text: str = ""
    note: str = ""
    at_least: bool = False
    open: str = ""

    @property
    def verdict(self) -> str:
        """Verdict: `holds`, `misses`, `open` for a known miss, or empty without a bar or a measurement."""
        if self.bar is None or self.value is None:
            return ""
        if self.value >= self.bar if self.at_least else self.value <= self.bar:
            return "holds"
        return "open" if self.open else "misses"

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "verdict": self.verdict}


def time(ns: float) -> str:
    """Returns a time as text in ns, µs or ms with three digits."""
    for limit, divisor, unit in ((1e3, 1, "ns"), (1e6, 1e3, "µs"), (1e9, 1e6, "ms")):
        if abs(ns) < limit:
            return f"{digits(ns / divisor)} {unit}"
    return f"{digits(ns / 1e9)} s"


def digits(value: float) -> str:
    """Returns a number with three digits."""
    return f"{value:.{2 if abs(value) < 10 else 1 if abs(value) < 100 else 0}f}"


def median(values: Iterable[float]) -> float:
    """Returns the median."""
    return statistics.median(values)


WIDTHS = (66, 15, 33, 7, 14, 6)
HEADINGS = ("what", "OpenGPAC", "beside it", "result", "bar", "")


def heading() -> str:
    return "  ".join(f"{text:<{width}}" for text, width in zip(HEADINGS, WIDTHS, strict=True)).rstrip()


def row(line: Line, before: str) -> str:
    """Returns the line as text, under the name of its group if that differs from the previous one."""
    cells = (line.what, line.ours, line.peer, line.shown, line.bar_text, line.verdict)
    text = "  ".join(f"{cell:<{width}}" for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()
    room = shutil.get_terminal_size((200, 50)).columns - sum(WIDTHS) - 2 * len(WIDTHS)
    if line.note:
        text = f"{text:<{sum(WIDTHS) + 2 * len(WIDTHS)}}{line.note}" if room >= len(line.note) else f"{text}\n      {line.note}"
    return text if line.row == before else f"\n{line.row}\n{text}"
