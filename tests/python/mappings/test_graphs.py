# SPDX-License-Identifier: Apache-2.0
"""One application, five mappings: each graph gives the same values, bit for bit, wherever its processors are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from afar import until
from mappings.graph import LENGTH, Stage, run
from mappings.graphs import GRAPHS
from mappings.mapping import MAPPINGS, Realization

REFERENCE = MAPPINGS["virtual"]
ATTEMPTS = 5
"""How often a run in real time is made that had to skip a release: its values are those of another program."""

_references: dict[str, dict[str, Any]] = {}


def recorded(name: str, mapping: Realization, built: dict[str, str], expected: dict[str, Any] | None = None) -> tuple[dict[str, Any], str]:
    """What the recorders of a graph hold on a mapping, and what went late there."""
    with mapping.open(name) as cell:
        stage = Stage(cell, built)
        values = run(stage, name, GRAPHS[name].make(stage))
        if expected is not None and not same(values, expected):
            # Counters of processors elsewhere come ten times a second: what was told after this moment twice is of after it.
            told_anew(cell)
            told_anew(cell)
        sources = cell.statistics["sources"]
    late = [
        f"{source}: {found['overruns']} skipped, {found['late']} late"
        for source, found in sources.items()
        if found["overruns"] or found["late"]
    ]
    return values, "; ".join(late)


def told_anew(cell: gpac.System) -> None:
    """Returns when every timer has been told to have gone on."""
    before = cell.statistics["sources"]
    timers = [source for source, found in before.items() if found["kind"] == "timer" and not found["stopped"]]
    until(lambda: all(cell.statistics["sources"][of]["firings"] > before[of]["firings"] for of in timers), "timers go on")


def reference(name: str, built: dict[str, str]) -> dict[str, Any]:
    """What they hold under the virtual clock."""
    if name not in _references:
        _references[name] = recorded(name, REFERENCE, built)[0]
    return _references[name]


def bits(values: Any) -> bytes:
    """The bytes of recorded values; integers of 64 bits come as a list."""
    return np.asarray(values, dtype=np.uint64 if isinstance(values, list) else None).tobytes()


def same(found: dict[str, Any], expected: dict[str, Any]) -> bool:
    return found.keys() == expected.keys() and all(bits(found[key]) == bits(expected[key]) for key in found)


def holds_skipping(name: str, found: dict[str, Any]) -> bool:
    """Whether what was found is right for a run that skipped releases: of graphs that go by numbers."""
    skipping = GRAPHS[name].skipping
    return skipping is not None and skipping(found)


def shown(found: dict[str, Any], expected: dict[str, Any]) -> str:
    """The first value that differs, of each recorder."""
    lines = []
    for key in expected:
        a, b = np.asarray(found[key]), np.asarray(expected[key])
        if not np.array_equal(a, b):
            at = next(n for n in range(a.size) if a[n].tobytes() != b[n].tobytes())
            lines.append(f"{key}[{at}] is {a[at]} instead of {b[at]}")
    return "; ".join(lines)


@pytest.mark.parametrize(
    "mapping", [mapping for mapping in MAPPINGS.values() if mapping is not REFERENCE], ids=lambda mapping: mapping.name
)
@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_gives_the_same_bits_on_every_mapping(name: str, mapping: Realization, built: dict[str, str]) -> None:
    expected = reference(name, built)
    lates = []
    while len(lates) < ATTEMPTS:
        found, late = recorded(name, mapping, built, expected)
        if same(found, expected):
            return
        assert late, f"no release was skipped, and yet {shown(found, expected)}"
        if holds_skipping(name, found):
            return
        lates.append(f"{late}: {shown(found, expected)}")
    pytest.fail("each run skipped a release: " + "; ".join(lates))


@pytest.mark.parametrize("name", [name for name, entry in GRAPHS.items() if entry.model])
def test_a_graph_gives_what_its_model_computes(name: str, built: dict[str, str]) -> None:
    model = GRAPHS[name].model
    assert model is not None
    found = reference(name, built)
    for key, values in model().items():
        assert bits(found[key]) == bits(list(values) if isinstance(found[key], list) else np.asarray(values, dtype=found[key].dtype)), key


@pytest.mark.parametrize("name", [name for name, entry in GRAPHS.items() if entry.skipping])
def test_what_holds_with_skipped_releases_is_told_from_what_does_not(name: str, built: dict[str, str]) -> None:
    found = reference(name, built)
    assert holds_skipping(name, found)
    assert not holds_skipping(name, {key: np.asarray(values)[::-1] for key, values in found.items()})
    assert not holds_skipping(name, {key: np.asarray(values) + 0.125 for key, values in found.items()})


@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_fills_its_recorders_and_is_placed_on_several_processors(name: str, built: dict[str, str]) -> None:
    with REFERENCE.open(name) as cell:
        stage = Stage(cell, built)
        made = GRAPHS[name].make(stage)
        values = run(stage, name, made)
        assert stage.processors >= 2
    assert all(np.asarray(value).size % LENGTH == 0 and len(np.unique(value)) > 1 for value in values.values())


def test_there_are_forty_graphs_and_models_of_ten() -> None:
    assert len(GRAPHS) >= 40 and sum(entry.model is not None for entry in GRAPHS.values()) >= 10
