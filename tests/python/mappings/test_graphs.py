# SPDX-License-Identifier: Apache-2.0
"""One application, five mappings: each graph gives the same values, bit for bit, wherever its processors are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from mappings.graph import LENGTH, Stage, run
from mappings.graphs import GRAPHS
from mappings.mapping import MAPPINGS
from mappings.oracles import ORACLES
from mappings.runs import REFERENCE, Shared, Told, bits, gives_the_same, holds_skipping, reference, verdict


@pytest.fixture(
    scope="module", params=[mapping for mapping in MAPPINGS.values() if mapping is not REFERENCE], ids=lambda mapping: mapping.name
)
def mapped(request: pytest.FixtureRequest, built: dict[str, str]) -> Iterator[Shared]:
    """Yields each mapping: one system for all graphs, except under the virtual clock."""
    shared = Shared(request.param, built)
    yield shared
    shared.close()


@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_gives_the_same_bits_on_every_mapping(name: str, mapped: Shared, built: dict[str, str]) -> None:
    gives_the_same(name, mapped, reference(name, built))


def test_a_difference_is_excused_by_what_explains_it_only(built: dict[str, str]) -> None:
    """If a value is changed, duplicated or missing, a skipped release is no excuse; a lost value makes it run again."""
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
    # A number may be missing only in a graph that depends on numbers; the values are still in order, each one possible.
    expected = reference("ratio_output_of_a_timer", built)
    missing = {"y": np.append(np.delete(expected["y"], 5), expected["y"][-1] + 4)}
    assert verdict("ratio_output_of_a_timer", missing, expected, skipped) == "right"
    assert "not what holds" in verdict("ratio_output_of_a_timer", {"y": missing["y"] + 0.5}, expected, skipped)


def test_a_list_that_was_left_before_all_values_came_is_no_loss(built: dict[str, str]) -> None:
    expected, nothing = reference("transition_within_a_source", built), Told([], [])
    a = np.asarray(expected["a"])
    sooner = {**expected, "a": np.where(np.arange(a.size) < 152, a, 0.0)}
    assert verdict("transition_within_a_source", sooner, expected, nothing) == "again"
    holed = {**expected, "a": np.append(np.delete(a, 5), 0.0)}
    assert verdict("transition_within_a_source", holed, expected, nothing).startswith("no release was skipped")


def test_a_reader_that_began_later_reads_on_from_the_first_number_that_came() -> None:
    later = [1e6 * (0 if j < 4 else 2 + (j - 4) // 5) + j for j in range(200)]
    assert holds_skipping("ratio_input_from_another_timer", {"y": later})
    ahead = [*later[:20], *(y + 1e6 for y in later[20:])]
    assert not holds_skipping("ratio_input_from_another_timer", {"y": ahead})


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
