# SPDX-License-Identifier: Apache-2.0
"""Every graph gives the bits of the virtual clock on two hosts, too: one after the other in one system, whose host has joined once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from mappings.graphs import GRAPHS
from mappings.mapping import EVERYWHERE, HOSTS
from mappings.runs import Shared, gives_the_same, reference

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


@pytest.fixture(scope="module")
def hosts(built: dict[str, str]) -> Iterator[Shared]:
    """Yields a mapping with the first processor here and the others on a host that has joined."""
    shared = Shared(HOSTS, built)
    yield shared
    shared.close()


@pytest.fixture(scope="module")
def everywhere(built: dict[str, str]) -> Iterator[Shared]:
    """Yields a mapping with a thread, a process, and a host that has joined."""
    shared = Shared(EVERYWHERE, built)
    yield shared
    shared.close()


@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_gives_the_same_bits_on_two_hosts(name: str, hosts: Shared, built: dict[str, str]) -> None:
    gives_the_same(name, hosts, reference(name, built))


@pytest.mark.parametrize("name", THROUGH_ALL)
def test_a_graph_gives_the_same_bits_on_threads_processes_and_hosts(name: str, everywhere: Shared, built: dict[str, str]) -> None:
    gives_the_same(name, everywhere, reference(name, built))
