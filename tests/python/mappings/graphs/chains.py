# SPDX-License-Identifier: Apache-2.0
"""Chains and fans: one value drives the next, from processor to processor."""

from __future__ import annotations

from itertools import accumulate

from mappings.graph import Graph, Model, Stage, graph, scattered
from opengpac import activate
from opengpac import library as lib


def _chain_model() -> Model:
    low: list[float] = []
    for u in scattered():
        before = low[-1] if low else 0.0
        low.append(before + 0.25 * (1.5 * u - before))
    return {"y": low}


@graph(_chain_model)
def chain_over_three(stage: Stage) -> Graph:
    """Scattered values with a gain on the next processor and a filter on the one after it."""
    return Graph(
        blocks={"wave": stage.code.scatter, "gain": lib.block("gain")(k=1.5), "low": lib.block("lowpass")(alpha=0.25)},
        cells={"a": ["wave.y", "gain.u"], "b": ["gain.y", "low.u"]},
        place={"wave": "0.fast", "gain": "1.soft", "low": "2.soft"},
        record={"y": "low.y"},
        start=[activate("low"), activate("gain"), activate("wave", every="2 ms")],
    )


@graph(lambda: {"y": [1.5 * u + 0.25 for u in scattered()]})
def chain_there_and_back(stage: Stage) -> Graph:
    """Values sent to another processor and back to a software source of the first."""
    return Graph(
        blocks={"wave": stage.code.scatter, "gain": lib.block("gain")(k=1.5), "bias": lib.block("bias")(b=0.25)},
        cells={"a": ["wave.y", "gain.u"], "b": ["gain.y", "bias.u"]},
        place={"wave": "0.fast", "gain": "1.soft", "bias": "0.soft"},
        record={"y": "bias.y"},
        start=[activate("wave", every="2 ms"), activate("gain"), activate("bias")],
    )


@graph(lambda: {"y": [u * 2.0**-8 + 0.0 for u in scattered()]})
def chain_of_eight(stage: Stage) -> Graph:
    """Eight hops back and forth between two processors, on two software sources each."""
    labels = [f"half{n}" for n in range(8)]
    where = ["1.soft", "0.soft", "1.low", "0.low"]
    return Graph(
        blocks={"wave": stage.code.scatter, **{label: lib.block("gain")(k=0.5) for label in labels}},
        cells={label: [f"{before}.y", f"{label}.u"] for before, label in zip(["wave", *labels], labels, strict=False)},
        place={"wave": "0.fast", **{label: where[n % 4] for n, label in enumerate(labels)}},
        record={"y": "half7.y"},
        start=[*(activate(label) for label in labels), activate("wave", every="2 ms")],
    )


@graph(lambda: {"y": [float(k) + 4.0 for k in range(200)]})
def ring_of_four(stage: Stage) -> Graph:
    """Values sent once around four processors, back to the first."""
    labels = [f"one{n}" for n in range(4)]
    return Graph(
        blocks={"ramp": stage.code.ramp, **{label: lib.block("bias")(b=1.0) for label in labels}},
        cells={label: [f"{before}.y", f"{label}.u"] for before, label in zip(["ramp", *labels], labels, strict=False)},
        place={"ramp": "0.fast", "one0": "1.soft", "one1": "2.soft", "one2": "3.soft", "one3": "0.soft"},
        record={"y": "one3.y"},
        start=[activate("ramp", every="2 ms"), *(activate(label) for label in labels)],
    )


@graph(lambda: {"a": [2.0 * u for u in scattered(5)], "b": [u + 3.0 for u in scattered(5)], "c": [abs(u) for u in scattered(5)]})
def fan_to_three(stage: Stage) -> Graph:
    """One value read by three processors, each of which computes a different result from it."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=5),
            "twice": lib.block("gain")(k=2.0),
            "more": lib.block("bias")(b=3.0),
            "size": lib.block("absolute"),
        },
        cells={"u": ["wave.y", "twice.u", "more.u", "size.u"]},
        place={"wave": "0.fast", "twice": "1.soft", "more": "2.soft", "size": "3.soft"},
        record={"a": "twice.y", "b": "more.y", "c": "size.y"},
        start=[activate("twice"), activate("more"), activate("size"), activate("wave", every="2 ms")],
    )


@graph()
def fan_on_two_sources_of_one(stage: Stage) -> Graph:
    """Two readers on different sources of one processor, and one on the writer's source."""
    return Graph(
        blocks={
            "wave": stage.code.scatter,
            "here": lib.block("gain")(k=3.0),
            "there": lib.block("gain")(k=5.0),
            "lower": lib.block("lowpass")(alpha=0.5),
        },
        cells={"u": ["wave.y", "here.u", "there.u", "lower.u"]},
        place={"wave": "0.fast", "here": "0.fast", "there": "1.soft", "lower": "1.low"},
        record={"here": "here.y", "there": "there.y", "lower": "lower.y"},
        start=[activate("wave", every="2 ms"), activate("here"), activate("there"), activate("lower")],
    )


def _sums(values: list[float]) -> list[float]:
    return [float(total) for total in accumulate(values)]


@graph(lambda: {"y": _sums(scattered())})
def echo_against_the_order(stage: Stage) -> Graph:
    """An accumulator: a value fed back against the firing order is that of the previous invocation."""
    return Graph(
        blocks={"wave": stage.code.scatter, "echo": stage.code.echo(g=1.0), "pass": lib.block("gain")(k=1.0)},
        cells={"u": ["wave.y", "echo.u"], "y": ["echo.y", "pass.u"], "back": ["pass.y", "echo.back"]},
        place={"wave": "0.fast", "echo": "0.fast", "pass": "0.fast", "record_y": "1.soft"},
        record={"y": "echo.y"},
        start=[activate("wave", every="2 ms"), activate("echo"), activate("pass")],
    )


@graph()
def echo_within_a_software_source(stage: Stage) -> Graph:
    """The same delay, with the loop on a processor driven by another one."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=9), "echo": stage.code.echo(g=0.75), "pass": lib.block("gain")(k=-1.0)},
        cells={"u": ["wave.y", "echo.u"], "y": ["echo.y", "pass.u"], "back": ["pass.y", "echo.back"]},
        place={"wave": "0.fast", "echo": "1.soft", "pass": "1.soft"},
        record={"y": "pass.y"},
        start=[activate("echo"), activate("pass"), activate("wave", every="2 ms")],
    )


@graph(lambda: {f"y{n}": [(n + 1.0) * u for u in scattered(n)] for n in range(8)})
def eight_chains_beside_each_other(stage: Stage) -> Graph:
    """Eight writers on one source with readers on another processor: one publication carries all their values."""
    numbers = range(8)
    return Graph(
        blocks={
            **{f"wave{n}": stage.code.scatter(seed=n) for n in numbers},
            **{f"gain{n}": lib.block("gain")(k=n + 1.0) for n in numbers},
        },
        cells={f"u{n}": [f"wave{n}.y", f"gain{n}.u"] for n in numbers},
        place={**{f"wave{n}": "0.fast" for n in numbers}, **{f"gain{n}": "1.soft" for n in numbers}},
        record={f"y{n}": f"gain{n}.y" for n in numbers},
        start=[*(activate(f"gain{n}") for n in numbers), *(activate(f"wave{n}", every="2 ms") for n in numbers)],
    )
