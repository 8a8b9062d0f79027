# SPDX-License-Identifier: Apache-2.0
"""Mappings of each conformance test, and the table of docs/evidence.md that lists them."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from mappings.mapping import MAPPINGS

SUITE = Path(__file__).parent.parent / "conformance"

ON_EACH = {"cell", "rig"}
"""Fixtures that provide a system of each mapping."""

IN_REAL_TIME = {"threads", "real"}
"""Fixtures that provide a system of some mappings in real time only."""

VIRTUAL_ONLY: dict[str, str] = {}
"""Tests that do not advance time themselves but need the virtual clock, and why."""

_COUNTS = "counts firings until the supervisor has answered"
_FAILS_BY_TIME = "its device fails at a time that is sooner than a busy machine has enabled it there"
_ELSEWHERE = {
    "test_r117_a_device_whose_verb_ends_is_lost_to_its_users": _FAILS_BY_TIME,
    "test_r118_parts_stay_where_they_were_placed": _COUNTS,
    "test_r118_redefining_a_part_leaves_the_composed_verb_as_it_was": _COUNTS,
}

NOT_ON: dict[str, dict[str, str]] = {"processes": _ELSEWHERE, "shared": _ELSEWHERE, "mixture": _ELSEWHERE}
"""Mapping → tests that do not run on it, and why."""


def mappings_of(test: Callable[..., Any]) -> list[str]:
    """Returns the names of the mappings that a conformance test runs on."""
    return _mappings(test.__name__, inspect.getsource(test))


def table() -> str:
    """Returns the table: for each file its tests, those that need no system, those on the virtual clock only, and those in real time,
    too."""
    lines = ["| file | tests | without a system | virtual clock only | in real time too |", "|---|---|---|---|---|"]
    sums = [0, 0, 0, 0]
    for file in sorted(SUITE.glob("test_*.py")):
        counts = [0, 0, 0, 0]
        for test, source in _tests(file):
            real = _runs_in_real_time(test, source)
            without = not (real or ON_EACH & _arguments(test))
            counts = [count + one for count, one in zip(counts, (1, without, not (without or real), real), strict=True)]
        sums = [a + b for a, b in zip(sums, counts, strict=True)]
        lines.append(f"| `{file.stem}` | {' | '.join(map(str, counts))} |")
    return "\n".join([*lines, f"| all | {' | '.join(map(str, sums))} |"])


def in_real_time() -> list[str]:
    """Returns the names of the tests that run in real time: those of `cell` and `rig` on every mapping."""
    return [test.name for file in sorted(SUITE.glob("test_*.py")) for test, source in _tests(file) if _runs_in_real_time(test, source)]


def _runs_in_real_time(test: ast.FunctionDef, source: str) -> bool:
    on_each = ON_EACH & _arguments(test) and any(not MAPPINGS[name].virtual for name in _mappings(test.name, source))
    return bool(on_each or IN_REAL_TIME & _arguments(test))


def _arguments(test: ast.FunctionDef) -> set[str]:
    return {argument.arg for argument in test.args.args}


def _mappings(name: str, source: str) -> list[str]:
    virtual = ".advance(" in source or name in VIRTUAL_ONLY
    return [key for key, mapping in MAPPINGS.items() if (mapping.virtual or not virtual) and name not in NOT_ON.get(key, {})]


def _tests(file: Path) -> Iterator[tuple[ast.FunctionDef, str]]:
    text = file.read_text()
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node, ast.get_source_segment(text, node) or ""
