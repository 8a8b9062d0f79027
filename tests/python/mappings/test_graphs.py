# SPDX-License-Identifier: Apache-2.0
"""One application, five mappings: each graph gives the same values, bit for bit, wherever its processors are."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import opengpac as gpac
from afar import until
from mappings.graph import LENGTH, Stage, run
from mappings.graphs import GRAPHS
from mappings.mapping import MAPPINGS, Realization
from mappings.oracles import ORACLES

REFERENCE = MAPPINGS["virtual"]
ATTEMPTS = 5
"""How often a run in real time is made in which a value was lost, and which has told it: its values are those of another program."""

_references: dict[str, dict[str, Any]] = {}


class Told(NamedTuple):
    """What the real-time system says of a run."""

    lost: list[str]
    """The values that found a queue full: they alone are excused."""
    skipped: list[str]
    """Sources that skipped releases, or had ratio values that were late: what is computed by count does not change by that."""


def recorded(name: str, mapping: Realization, built: dict[str, str], expected: dict[str, Any] | None = None) -> tuple[dict[str, Any], Told]:
    """What the recorders of a graph hold on a mapping, and what was told of the run."""
    with mapping.open(name) as cell:
        stage = Stage(cell, built)
        values = run(stage, name, GRAPHS[name].make(stage))
        if expected is not None and not same(values, expected):
            # What processors elsewhere tell comes ten times a second: what was told after this moment twice is of after it.
            told_anew(cell)
            told_anew(cell)
        return values, Told(
            [entry["text"] for entry in cell.log() if entry["kind"] == "overrun"],
            [
                f"{source}: {found['overruns']} skipped, {found['late']} late"
                for source, found in cell.statistics["sources"].items()
                if found["overruns"] or found["late"]
            ],
        )


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


def verdict(name: str, found: dict[str, Any], expected: dict[str, Any], told: Told) -> str:
    """What a run shows: `right`, `again` (a value was lost, which is told), or what is wrong with it."""
    if same(found, expected):
        return "right"
    differs = shown(found, expected)
    if told.lost:
        return "again"
    if not told.skipped:
        return f"no release was skipped, and yet {differs}"
    if GRAPHS[name].skipping is None:
        return f"releases were skipped ({'; '.join(told.skipped)}), which cannot explain that {differs}: it goes by count"
    return "right" if holds_skipping(name, found) else f"not what holds with skipped releases ({'; '.join(told.skipped)}): {differs}"


def shown(found: dict[str, Any], expected: dict[str, Any]) -> str:
    """The first value that differs, of each recorder."""
    lines = []
    for key in expected:
        a, b = np.asarray(found[key]), np.asarray(expected[key])
        if a.shape != b.shape:
            lines.append(f"{key} has {a.size} values instead of {b.size}")
        elif not np.array_equal(a, b):
            at = next(n for n in range(a.size) if a[n].tobytes() != b[n].tobytes())
            lines.append(f"{key}[{at}] is {a[at]} instead of {b[at]}")
    return "; ".join(lines)


@pytest.mark.parametrize(
    "mapping", [mapping for mapping in MAPPINGS.values() if mapping is not REFERENCE], ids=lambda mapping: mapping.name
)
@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_gives_the_same_bits_on_every_mapping(name: str, mapping: Realization, built: dict[str, str]) -> None:
    expected = reference(name, built)
    lost: list[str] = []
    for _ in range(ATTEMPTS):
        found, told = recorded(name, mapping, built, expected)
        said = verdict(name, found, expected, told)
        assert said in ("right", "again"), said
        if said == "right":
            return
        lost += told.lost
    pytest.fail(f"each run lost a value: {lost}")


def test_a_difference_is_excused_by_what_explains_it_only(built: dict[str, str]) -> None:
    """One value is changed, doubled or missing: that a release was skipped is no excuse; that a value was lost makes it run again."""
    skipped, lost = Told([], ["rtp0.fast: 3 skipped, 0 late"]), Told(["the queue was full"], [])
    for name, recorder in (("chain_over_three", "y"), ("join_of_two_timers", "y"), ("ratio_output_of_a_timer", "y")):
        expected = reference(name, built)
        values = np.asarray(expected[recorder])
        assert verdict(name, expected, expected, skipped) == "right"
        for wrong in (np.where(np.arange(values.size) == 7, values + 0.5, values), np.roll(values, 1), np.delete(values, 5)):
            found = {**expected, recorder: wrong}
            assert verdict(name, found, expected, Told([], [])).startswith("no release was skipped")
            assert verdict(name, found, expected, lost) == "again"
            if name != "ratio_output_of_a_timer":
                assert "cannot explain" in verdict(name, found, expected, skipped)
    # Only where it goes by numbers may a number be missing; values still come in order, and each of those that may.
    expected = reference("ratio_output_of_a_timer", built)
    missing = {"y": np.append(np.delete(expected["y"], 5), expected["y"][-1] + 4)}
    assert verdict("ratio_output_of_a_timer", missing, expected, skipped) == "right"
    assert "not what holds" in verdict("ratio_output_of_a_timer", {"y": missing["y"] + 0.5}, expected, skipped)


@pytest.mark.parametrize("name", [name for name, entry in GRAPHS.items() if entry.model])
def test_a_graph_gives_what_its_model_computes(name: str, built: dict[str, str]) -> None:
    model = GRAPHS[name].model
    assert model is not None
    found = reference(name, built)
    for key, values in model().items():
        assert bits(found[key]) == bits(list(values) if isinstance(found[key], list) else np.asarray(values, dtype=found[key].dtype)), key


@pytest.mark.parametrize("name", ORACLES)
def test_a_graph_gives_what_something_else_computes(name: str, built: dict[str, str]) -> None:
    found = reference(name, built)
    oracle = ORACLES[name]
    for key, values in oracle.of(found).items():
        if oracle.is_exact:
            np.testing.assert_array_equal(found[key], values, err_msg=key)
        else:
            np.testing.assert_allclose(found[key], values, rtol=1e-9, atol=1e-9, err_msg=key)


def test_no_graph_is_compared_with_itself_alone() -> None:
    assert {name for name, entry in GRAPHS.items() if entry.model is None or name in ORACLES} == {*ORACLES}


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
