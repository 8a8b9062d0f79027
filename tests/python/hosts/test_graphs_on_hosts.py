# SPDX-License-Identifier: Apache-2.0
"""Every graph gives the bits of the virtual clock on two hosts too: one after the other in one system, whose host has joined once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import opengpac as gpac
from mappings.graph import Stage, run
from mappings.graphs import GRAPHS
from mappings.mapping import EVERYWHERE, HOSTS, Realization
from mappings.test_graphs import ATTEMPTS, Told, reference, same, told_anew, verdict

THROUGH_ALL = [
    "chain_over_three",
    "ring_of_four",
    "diamond_with_a_long_side",
    "join_of_three_processors",
    "three_readers_of_a_join",
    "two_rates_beside_each_other",
    "struct_over_three_processors",
    "graph_in_a_graph",
    "ending_list_elsewhere",
    "suspended_and_resumed",
]
"""Graphs in which values go from a process to another host, and from there to a process."""


class Shared:
    """One system for many graphs. What it has told before belongs to the graphs before."""

    def __init__(self, mapping: Realization, built: dict[str, str]) -> None:
        self._mapping, self._built = mapping, built
        self._cell: gpac.System | None = None
        self._stage: Stage | None = None

    def run(self, name: str, expected: dict[str, Any]) -> tuple[dict[str, Any], Told]:
        """What a graph gives here, and what was told of that. A system in which one has failed is left."""
        try:
            before = self._counts()
            found = run(self._ready, name, GRAPHS[name].make(self._ready))
            if not same(found, expected):
                # What happened elsewhere is told some 100 ms later.
                for _ in range(3):
                    told_anew(self._ready.cell)
            now = self._counts()
            return found, Told(now[0][len(before[0]) :], [f"{of}: {count}" for of, count in now[1].items() if count != before[1].get(of)])
        except BaseException:
            self.close()
            raise

    def _counts(self) -> tuple[list[str], dict[str, str]]:
        """Values that were lost in a full queue, and what each source has skipped or had late, since the system began."""
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


@pytest.fixture(scope="module")
def hosts(built: dict[str, str]) -> Iterator[Shared]:
    """The first processor here, the others on a host that has joined."""
    shared = Shared(HOSTS, built)
    yield shared
    shared.close()


@pytest.fixture(scope="module")
def everywhere(built: dict[str, str]) -> Iterator[Shared]:
    """A thread, a process, and a host that has joined."""
    shared = Shared(EVERYWHERE, built)
    yield shared
    shared.close()


def gives_the_same(name: str, shared: Shared, expected: dict[str, Any]) -> None:
    """A run that lost nothing gives the same; one that did has told it, and is made again."""
    lost: list[str] = []
    for _ in range(ATTEMPTS):
        found, told = shared.run(name, expected)
        said = verdict(name, found, expected, told)
        assert said in ("right", "again"), said
        if said == "right":
            return
        lost += told.lost
    pytest.fail(f"each run lost a value: {lost}")


@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_gives_the_same_bits_on_two_hosts(name: str, hosts: Shared, built: dict[str, str]) -> None:
    gives_the_same(name, hosts, reference(name, built))


@pytest.mark.parametrize("name", THROUGH_ALL)
def test_a_graph_gives_the_same_bits_on_threads_processes_and_hosts(name: str, everywhere: Shared, built: dict[str, str]) -> None:
    gives_the_same(name, everywhere, reference(name, built))
