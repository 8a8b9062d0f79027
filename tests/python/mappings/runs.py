# SPDX-License-Identifier: Apache-2.0
"""Runs of graphs on a mapping, and their verdicts: the same bits, a value that was lost and reported, or a fault."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import opengpac as gpac
from afar import until
from mappings.graph import Stage, run
from mappings.graphs import GRAPHS
from mappings.mapping import MAPPINGS, Realization

REFERENCE = MAPPINGS["virtual"]
ATTEMPTS = 5
"""Maximum number of runs in real time while runs lose and report a value: their values are those of another program."""

_references: dict[str, dict[str, Any]] = {}


class Told(NamedTuple):
    """Reports of the real-time system about a run."""

    lost: list[str]
    """Values that found a queue full, the only ones excused."""
    skipped: list[str]
    """Sources that skipped releases or had late ratio values: results computed by count do not change."""


def told_anew(cell: gpac.System) -> None:
    """Waits until every timer has reported progress."""
    before = cell.statistics["sources"]
    timers = [source for source, found in before.items() if found["kind"] == "timer" and not found["stopped"]]
    until(lambda: all(cell.statistics["sources"][of]["firings"] > before[of]["firings"] for of in timers), "timers go on")


def reference(name: str, built: dict[str, str]) -> dict[str, Any]:
    """Returns the recorders' contents under the virtual clock."""
    if name not in _references:
        with REFERENCE.open(name) as cell:
            stage = Stage(cell, built)
            _references[name] = run(stage, name, GRAPHS[name].make(stage))
    return _references[name]


def bits(values: Any) -> bytes:
    """Returns the bytes of recorded values; integers of 64 bits come as a list."""
    return np.asarray(values, dtype=np.uint64 if isinstance(values, list) else None).tobytes()


def same(found: dict[str, Any], expected: dict[str, Any]) -> bool:
    return found.keys() == expected.keys() and all(bits(found[key]) == bits(expected[key]) for key in found)


def holds_skipping(name: str, found: dict[str, Any]) -> bool:
    """Returns whether the values are right for a run that skipped releases, for graphs that depend on numbers."""
    skipping = GRAPHS[name].skipping
    return skipping is not None and skipping(found)


def ends_sooner(found: dict[str, Any], expected: dict[str, Any]) -> bool:
    """Returns whether recorders contain the first of the expected values and then none: zeros, their initial contents."""

    def begins(values: Any, whole: Any) -> bool:
        taken = len(np.trim_zeros(values, "b"))
        return len(values) == len(whole) and bits(values[:taken]) == bits(whole[:taken])

    return found.keys() == expected.keys() and all(begins(found[key], expected[key]) for key in found)


def verdict(name: str, found: dict[str, Any], expected: dict[str, Any], told: Told) -> str:
    """Returns the verdict of a run: `right`, `again` (a value was lost, which is reported, or came after its list), or its fault."""
    if same(found, expected):
        return "right"
    differs = shown(found, expected)
    if told.lost or (GRAPHS[name].left_by_count and ends_sooner(found, expected)):
        return "again"
    if not told.skipped and GRAPHS[name].begins_later and holds_skipping(name, found):
        return "again"
    if not told.skipped:
        return f"no release was skipped, and yet {differs}"
    if GRAPHS[name].skipping is None:
        return f"releases were skipped ({'; '.join(told.skipped)}), which cannot explain that {differs}: it goes by count"
    return "right" if holds_skipping(name, found) else f"not what holds with skipped releases ({'; '.join(told.skipped)}): {differs}"


def shown(found: dict[str, Any], expected: dict[str, Any]) -> str:
    """Returns the first differing value of each recorder."""
    lines = []
    for key in expected:
        a, b = np.asarray(found[key]), np.asarray(expected[key])
        if a.shape != b.shape:
            lines.append(f"{key} has {a.size} values instead of {b.size}")
        elif not np.array_equal(a, b):
            at = next(n for n in range(a.size) if a[n].tobytes() != b[n].tobytes())
            lines.append(f"{key}[{at}] is {a[at]} instead of {b[at]}")
    return "; ".join(lines)


class Shared:
    """System of a mapping shared by many graphs; earlier reports belong to earlier graphs. Under the virtual clock each graph has its
    own."""

    def __init__(self, mapping: Realization, built: dict[str, str]) -> None:
        self._mapping, self._built = mapping, built
        self._cell: gpac.System | None = None
        self._stage: Stage | None = None

    def run(self, name: str, expected: dict[str, Any]) -> tuple[dict[str, Any], Told]:
        """Returns the values of a graph here, and the reports about them. A system in which a run has failed is abandoned."""
        try:
            before = self._counts()
            found = run(self._ready, name, GRAPHS[name].make(self._ready))
            if not same(found, expected):
                # Reports of remote processors arrive ten times a second.
                for _ in range(3):
                    told_anew(self._ready.cell)
            now = self._counts()
            if self._mapping.virtual:
                self.close()
            return found, Told(now[0][len(before[0]) :], [f"{of}: {count}" for of, count in now[1].items() if count != before[1].get(of)])
        except BaseException:
            self.close()
            raise

    def _counts(self) -> tuple[list[str], dict[str, str]]:
        """Returns the values lost in a full queue, and each source's skipped releases and late values, since the system began."""
        cell = self._ready.cell
        sources = cell.statistics["sources"]
        counts = {name: f"{of['overruns']} skipped, {of['late']} late" for name, of in sources.items() if of["overruns"] or of["late"]}
        return [entry["text"] for entry in cell.log() if entry["kind"] == "overrun"], counts

    def close(self) -> None:
        if self._cell is not None:
            self._cell.close()
        self._cell = self._stage = None

    @property
    def _ready(self) -> Stage:
        if self._stage is None:
            self._cell = self._mapping.open("graphs")
            self._stage = Stage(self._cell, self._built)
        return self._stage


def gives_the_same(name: str, shared: Shared, expected: dict[str, Any]) -> None:
    """Checks that a run without losses gives the same values; one with losses has reported them, and is repeated."""
    lost: list[str] = []
    for _ in range(ATTEMPTS):
        found, told = shared.run(name, expected)
        said = verdict(name, found, expected, told)
        assert said in ("right", "again"), said
        if said == "right":
            return
        lost += told.lost
    pytest.fail(f"each run lost a value: {lost}")
