# SPDX-License-Identifier: Apache-2.0
"""Each graph gives the same values, bit for bit, with its blocks fused.

`OPENGPAC_FUSED_GRAPHS=all` runs all of them; otherwise only those in which something is fused run.
"""

from __future__ import annotations

import os
from typing import Any

import pytest

import opengpac as gpac
from conftest import BLOCKS
from mappings.graph import Stage, run
from mappings.graphs import GRAPHS
from mappings.runs import REFERENCE, reference, same

FUSED = ("echo_against_the_order", "ratio_input_beside_a_synchronous_one")
"""Graphs in which blocks of C sources read each other on one interrupt source: in the others nothing is fused."""


@pytest.mark.parametrize("name", GRAPHS if os.environ.get("OPENGPAC_FUSED_GRAPHS") == "all" else FUSED)
def test_a_graph_gives_the_same_bits_fused(name: str, built: dict[str, str]) -> None:
    told: list[Any] = []
    with REFERENCE.open(name) as cell:
        # Built from the source: the source of a shared object is unknown.
        stage = Stage(cell, {"mapping": str(BLOCKS / "mapping.c")})
        made = GRAPHS[name].make(stage)
        during = made.during

        def fused(instance: gpac.VerbInstance[Any]) -> None:
            told.append(cell.fuse())
            if during:
                during(instance)

        made.during = fused
        found = run(stage, name, made)
    assert same(found, reference(name, built))
    assert not any(group["why"] for group in told[0]["groups"])
    assert any(group["fused"] for group in told[0]["groups"]) == (name in FUSED)
