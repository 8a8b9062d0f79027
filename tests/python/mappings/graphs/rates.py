# SPDX-License-Identifier: Apache-2.0
"""Rates: ratio inputs and outputs, blocks that run once per several invocations of others, histories, intervals that change."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import opengpac as gpac
from mappings.graph import LENGTH, Found, Graph, Model, Stage, graph, scattered
from opengpac import activate
from opengpac import library as lib


def _rise(values: Sequence[float]) -> bool:
    return all(a < b for a, b in pairwise(values))


def _stay(values: Sequence[float]) -> bool:
    return all(a <= b for a, b in pairwise(values))


def _means(values: list[float]) -> list[float]:
    return [(((values[k] + values[k + 1]) + values[k + 2]) + values[k + 3]) / 4.0 for k in range(0, len(values), 4)]


@graph(lambda: {"y": _means(scattered(length=4 * LENGTH))})
def ratio_output_to_another_processor(stage: Stage) -> Graph:
    """Every fourth invocation outputs a mean; only the mean drives the reader on another processor."""
    return Graph(
        blocks={"wave": stage.code.scatter, "mean": stage.code.mean_of_four, "pass": lib.block("gain")(k=1.0)},
        cells={"u": ["wave.y", "mean.u"], "m": ["mean.y", "pass.u"]},
        place={"wave": "0.fast", "mean": "1.soft", "pass": "2.soft"},
        record={"y": "pass.y"},
        start=[activate("pass"), activate("mean"), activate("wave", every="2 ms")],
    )


def _pairs(values: list[float]) -> list[float]:
    return [a + b for a, b in zip(values[::2], values[1::2], strict=True)]


@graph(lambda: {"y": _pairs(_pairs(scattered(length=4 * LENGTH)))})
def decimation_in_two_steps(stage: Stage) -> Graph:
    """Sums of two values, then sums of two of these sums, on two processors."""
    return Graph(
        blocks={"wave": stage.code.scatter, "first": stage.code.pair_sum, "second": stage.code.pair_sum},
        cells={"u": ["wave.y", "first.u"], "v": ["first.y", "second.u"]},
        place={"wave": "0.fast", "first": "1.soft", "second": "2.soft", "record_y": "0.soft"},
        record={"y": "second.y"},
        start=[activate("second"), activate("first"), activate("wave", every="2 ms")],
    )


def _every_fourth(found: Found) -> bool:
    y = found["y"]
    return all(value % 4 == 3 for value in y) and _rise(y)


@graph(lambda: {"y": [float(4 * k + 3) for k in range(LENGTH)]}, skipping=_every_fourth)
def ratio_output_of_a_timer(stage: Stage) -> Graph:
    """A block on a timer that stores every fourth value."""
    return Graph(
        blocks={"ramp": stage.code.number_of_four, "pass": lib.block("gain")(k=1.0)},
        cells={"u": ["ramp.y", "pass.u"]},
        place={"ramp": "0.fast", "pass": "1.soft"},
        record={"y": "pass.y"},
        start=[activate("pass"), activate("ramp", every="2 ms")],
    )


def _read_by_number(found: Found) -> bool:
    """Returns whether the values read are possible. A value read has at most number j // 5 - 1: that one may have been skipped, or be
    late. If the machine was delayed while both began, the reader began later: from the first number that arrived it reads at most one
    more in five invocations."""
    read = [divmod(y, 1e6) for y in found["y"]]
    came = next((n for n, (u, _) in enumerate(read) if u > 0), len(read) - 1)
    # The invocations between the last one without a value and the first one with it may have been skipped.
    number, since = read[came][0], read[came - 1][1] + 1 if came else 0

    def most(j: float) -> float:
        return max(0, j // 5 - 1, number + (j - since) // 5 if j >= since else 0)

    return _rise([j for _, j in read]) and _stay([u for u, _ in read]) and all(j % 1 == 0 and u <= most(j) for u, j in read)


@graph(lambda: {"y": [1e6 * max(0, j // 5 - 1) + j for j in range(LENGTH)]}, skipping=_read_by_number, begins_later=True)
def ratio_input_from_another_timer(stage: Stage) -> Graph:
    """Values of a slow processor, read by number in a fast one: invocation j has value j // 5 - 1."""
    return Graph(
        blocks={"ramp": stage.code.number, "held": stage.code.held},
        cells={"u": ["ramp.y", "held.u"]},
        place={"ramp": "0.slow", "held": "1.fast"},
        record={"y": "held.y"},
        start=[activate("ramp", every="10 ms"), activate("held", every="2 ms")],
    )


def _slow_beside_fast(found: Found) -> bool:
    """Returns whether the fast values are complete and the slow ones never go back."""
    slow = [round((y - 0.5 - fast) / 1000.0) for y, fast in zip(found["y"], scattered(), strict=True)]
    return _stay(slow) and list(found["y"]) == [(1000.0 * u + fast) + 0.5 for u, fast in zip(slow, scattered(), strict=True)]


@graph(skipping=_slow_beside_fast)
def ratio_input_beside_a_synchronous_one(stage: Stage) -> Graph:
    """A slow value from another processor and a value of the block's own source, with a reader on a third processor."""
    return Graph(
        blocks={
            "slow": stage.code.number,
            "fast": stage.code.scatter,
            "beside": stage.code.beside,
            "pass": lib.block("bias")(b=0.5),
        },
        cells={"s": ["slow.y", "beside.slow"], "f": ["fast.y", "beside.fast"], "y": ["beside.y", "pass.u"]},
        place={"slow": "1.slow", "fast": "0.fast", "beside": "0.fast", "pass": "2.soft"},
        record={"y": "pass.y"},
        start=[activate("pass"), activate("slow", every="10 ms"), activate("beside"), activate("fast", every="2 ms")],
    )


@graph()
def divided_graph(stage: Stage) -> Graph:
    """In one graph a block runs once per five invocations of the others; both results go to another processor."""
    law = gpac.Graph(
        "law",
        blocks={"quick": stage.code.ramp, "slow": stage.code.ramp(step=100.0)},
        outputs={"quick": "quick.y", "slow": "slow.y"},
        divide={"slow": 5},
    )
    return Graph(
        blocks={"law": law, "quick": lib.block("gain")(k=1.0), "slow": lib.block("gain")(k=1.0)},
        cells={"a": ["law.quick", "quick.u"], "b": ["law.slow", "slow.u"]},
        place={"law": "0.fast", "quick": "1.soft", "slow": "1.soft"},
        record={"quick": "quick.y", "slow": "slow.y"},
        start=[activate("quick"), activate("slow"), activate("law", every="2 ms")],
    )


@graph(lambda: {"fast": scattered(31), "slow": scattered(32)})
def two_rates_beside_each_other(stage: Stage) -> Graph:
    """Two timers of different periods feed one software source, each with its own reader."""
    return Graph(
        blocks={
            "fast": stage.code.scatter(seed=31),
            "slow": stage.code.scatter(seed=32),
            "a": lib.block("gain")(k=1.0),
            "b": lib.block("gain")(k=1.0),
        },
        cells={"f": ["fast.y", "a.u"], "s": ["slow.y", "b.u"]},
        place={"fast": "0.fast", "slow": "1.fast", "a": "2.soft", "b": "2.soft"},
        record={"fast": "a.y", "slow": "b.y"},
        start=[activate("a"), activate("b"), activate("fast", every="2 ms"), activate("slow", every="4 ms")],
    )


@graph()
def interval_that_changes(stage: Stage) -> Graph:
    """The interval changes during the run: the values arrive faster or slower, and stay the same."""

    def change(instance: gpac.VerbInstance[Any]) -> None:
        for every in ("4 ms", "2 ms"):
            instance.set(every={"wave": every})

    return Graph(
        blocks={"wave": stage.code.scatter, "low": lib.block("lowpass")(alpha=0.125)},
        cells={"u": ["wave.y", "low.u"]},
        place={"wave": "0.fast", "low": "1.soft"},
        record={"y": "low.y"},
        start=[activate("low"), activate("wave", every=gpac.interval("2 ms", tunable=True))],
        during=change,
    )


def _windows() -> Model:
    past = [0.0, 0.0, 0.0]
    values = [0.5 * k for k in range(LENGTH)]
    return {"y": [[*past, *values][k : k + 4] for k in range(LENGTH)]}


@graph(_windows)
def history_of_the_own_source(stage: Stage) -> Graph:
    """The last four values of an SVV with a history, in the firing that wrote the newest."""
    return Graph(
        blocks={"ramp": stage.code.ramp(step=0.5), "recent": stage.code.recent},
        cells={"u": ["ramp.y", "recent.u"]},
        place={"ramp": "0.fast", "recent": "0.fast", "record_y": "1.soft"},
        record={"y": "recent.y"},
        recorder={"y": "record_vector"},
        start=[activate("ramp", every="2 ms"), activate("recent", every="2 ms")],
    )


@graph()
def history_then_a_filter_elsewhere(stage: Stage) -> Graph:
    """The slope of the last three values, then a filter on another processor."""
    return Graph(
        blocks={"wave": stage.code.scatter, "slope": stage.code.steepness, "low": lib.block("lowpass")(alpha=0.5)},
        cells={"u": ["wave.y", "slope.u"], "v": ["slope.y", "low.u"]},
        place={"wave": "0.fast", "slope": "0.fast", "low": "1.soft"},
        record={"y": "low.y"},
        start=[activate("low"), activate("wave", every="2 ms"), activate("slope", every="2 ms")],
    )
