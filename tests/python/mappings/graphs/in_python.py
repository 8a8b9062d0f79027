# SPDX-License-Identifier: Apache-2.0
"""Blocks in Python, compiled when a graph requests them."""

from __future__ import annotations

import functools
from typing import Annotated as A
from typing import Any

import opengpac as gpac
from mappings.graph import Graph, Model, Stage, graph, scattered
from opengpac import activate
from opengpac.python import Input, Output, Parameter, State


@functools.cache
def _smooth() -> Any:
    @gpac.block
    def smooth(
        u: A[float, Input("raw")],
        y: A[float, Output("smooth")],
        x: A[float, State("memory")] = 0.5,
        alpha: A[float, Parameter("factor")] = 0.25,
    ):
        """First-order filter."""
        x += alpha * (u - x)
        y = x
        return y, x

    return smooth


def _smoothed() -> Model:
    values, x = [], 0.5
    for u in scattered(61):
        x += 0.25 * (u - x)
        values.append(x)
    twice, x = [], 0.5
    for u in values:
        x += 0.125 * (u - x)
        twice.append(x)
    return {"once": values, "twice": twice}


@graph(_smoothed)
def python_blocks_in_a_row(stage: Stage) -> Graph:
    """A compiled Python function, in two instances on two processors."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=61), "one": _smooth(), "two": _smooth()(alpha=0.125)},
        cells={"u": ["wave.y", "one.u"], "x": ["one.y", "two.u"]},
        place={"wave": "0.fast", "one": "1.soft", "two": "2.soft"},
        record={"once": "one.y", "twice": "two.y"},
        start=[activate("two"), activate("one"), activate("wave", every="2 ms")],
    )
