# SPDX-License-Identifier: Apache-2.0
"""Graphs whose processors are on two hosts give the bits of the virtual clock."""

from __future__ import annotations

import pytest

from mappings.graph import Stage, run
from mappings.graphs import GRAPHS
from mappings.mapping import HOSTS
from mappings.test_graphs import ATTEMPTS, reference, same, shown

ON_HOSTS = ["chain_over_three", "chain_there_and_back", "fan_to_three", "tree_of_joins", "join_here_and_there"]


@pytest.mark.parametrize("name", ON_HOSTS)
def test_a_graph_gives_the_same_bits_on_two_hosts(name: str, built: dict[str, str]) -> None:
    expected = reference(name, built)
    told = []
    while len(told) < ATTEMPTS:
        with HOSTS.open(name) as cell:
            stage = Stage(cell, built)
            found = run(stage, name, GRAPHS[name].make(stage))
            # A loaded machine skips releases, and its network brings values in bursts: both are told, and make another program of it.
            lost = [entry["text"] for entry in cell.log() if entry["kind"] == "overrun"]
            skipped = [name for name, source in cell.statistics["sources"].items() if source["overruns"] or source["late"]]
        if same(found, expected):
            return
        assert lost or skipped, f"nothing was told, and yet {shown(found, expected)}"
        told.append(f"{skipped} {lost[:1]}")
    pytest.fail("each run lost something, and told it: " + "; ".join(told))
