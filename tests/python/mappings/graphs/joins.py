# SPDX-License-Identifier: Apache-2.0
"""Joins: blocks that run when each of several writers, on several processors, has written a new value."""

from __future__ import annotations

from mappings.graph import Graph, Stage, graph, scattered
from opengpac import activate
from opengpac import library as lib


@graph(lambda: {"y": [u + (10.0 - 0.5 * k) for k, u in enumerate(scattered())]})
def join_of_two_timers(stage: Stage) -> Graph:
    """The k-th value of one processor meets the k-th of another, on a third."""
    return Graph(
        blocks={"wave": stage.code.scatter, "ramp": stage.code.ramp(first=10.0, step=-0.5), "add": stage.code.add},
        cells={"a": ["wave.y", "add.a"], "b": ["ramp.y", "add.b"]},
        place={"wave": "0.fast", "ramp": "1.fast", "add": "2.soft"},
        record={"y": "add.y"},
        start=[activate("add"), activate("wave", every="2 ms"), activate("ramp", every="2 ms")],
    )


@graph(lambda: {"y": [float(k) + 10 * (0.5 * k) + 100 * u for k, u in enumerate(scattered(3))]})
def join_of_three_processors(stage: Stage) -> Graph:
    """Three writers on three processors, one reader on a fourth."""
    return Graph(
        blocks={"a": stage.code.ramp, "b": stage.code.ramp(step=0.5), "c": stage.code.scatter(seed=3), "weigh": stage.code.weigh},
        cells={"a": ["a.y", "weigh.a"], "b": ["b.y", "weigh.b"], "c": ["c.y", "weigh.c"]},
        place={"a": "0.fast", "b": "1.fast", "c": "2.fast", "weigh": "3.soft"},
        record={"y": "weigh.y"},
        start=[activate("weigh"), activate("a", every="2 ms"), activate("b", every="2 ms"), activate("c", every="2 ms")],
    )


@graph(lambda: {"y": [2.0 * u + 3.0 * u for u in scattered(11)]})
def diamond(stage: Stage) -> Graph:
    """One value takes two paths, over two processors, which join on the processor where it started."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=11),
            "left": lib.block("gain")(k=2.0),
            "right": lib.block("gain")(k=3.0),
            "add": stage.code.add,
        },
        cells={"u": ["wave.y", "left.u", "right.u"], "a": ["left.y", "add.a"], "b": ["right.y", "add.b"]},
        place={"wave": "0.fast", "left": "1.soft", "right": "2.soft", "add": "0.soft"},
        record={"y": "add.y"},
        start=[activate("add"), activate("left"), activate("right"), activate("wave", every="2 ms")],
    )


@graph(lambda: {"y": [u + 8.0 * u for u in scattered(12)]})
def diamond_with_a_long_side(stage: Stage) -> Graph:
    """One path is direct, the other has three hops: values are joined by order, not by time."""
    gains = {f"twice{n}": lib.block("gain")(k=2.0) for n in range(3)}
    return Graph(
        blocks={"wave": stage.code.scatter(seed=12), **gains, "add": stage.code.add},
        cells={
            "u": ["wave.y", "add.a", "twice0.u"],
            "v": ["twice0.y", "twice1.u"],
            "w": ["twice1.y", "twice2.u"],
            "x": ["twice2.y", "add.b"],
        },
        place={"wave": "0.fast", "twice0": "1.soft", "twice1": "2.soft", "twice2": "1.low", "add": "0.soft"},
        record={"y": "add.y"},
        start=[activate("wave", every="2 ms"), *(activate(label) for label in gains), activate("add")],
    )


@graph()
def join_here_and_there(stage: Stage) -> Graph:
    """One input is driven in the firing of its own processor, the other by another processor."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=13),
            "there": lib.block("gain")(k=2.0),
            "back": lib.block("bias")(b=1.0),
            "again": lib.block("gain")(k=-3.0),
            "add": stage.code.add,
        },
        cells={"u": ["wave.y", "there.u"], "v": ["there.y", "back.u", "again.u"], "a": ["back.y", "add.a"], "b": ["again.y", "add.b"]},
        place={"wave": "0.fast", "there": "1.soft", "back": "1.soft", "again": "2.soft", "add": "1.low"},
        record={"y": "add.y"},
        start=[activate("add"), activate("again"), activate("back"), activate("there"), activate("wave", every="2 ms")],
    )


@graph(
    lambda: {
        "y": [(a + b) * 2.0 + (float(k) + c) for k, (a, b, c) in enumerate(zip(scattered(1), scattered(2), scattered(4), strict=True))]
    }
)
def tree_of_joins(stage: Stage) -> Graph:
    """Nested joins: four writers on two processors, two joins on a third, the last join on the first."""
    code = stage.code
    return Graph(
        blocks={
            "a": code.scatter(seed=1),
            "b": code.scatter(seed=2),
            "c": code.ramp,
            "d": code.scatter(seed=4),
            "ab": code.add,
            "twice": lib.block("gain")(k=2.0),
            "cd": code.add,
            "all": code.add,
        },
        cells={
            "a": ["a.y", "ab.a"], "b": ["b.y", "ab.b"], "c": ["c.y", "cd.a"], "d": ["d.y", "cd.b"],
            "ab": ["ab.y", "twice.u"], "l": ["twice.y", "all.a"], "r": ["cd.y", "all.b"],
        },
        place={
            "a": "0.fast", "c": "0.fast", "b": "1.fast", "d": "1.fast",
            "ab": "2.soft", "twice": "2.soft", "cd": "2.low", "all": "0.soft",
        },
        record={"y": "all.y"},
        start=[
            *(activate(label) for label in ("all", "twice", "ab", "cd")),
            *(activate(label, every="2 ms") for label in ("a", "b", "c", "d")),
        ],
    )  # fmt: skip


@graph()
def three_readers_of_a_join(stage: Stage) -> Graph:
    """The output of a join goes to both processors that supply its inputs."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=21),
            "ramp": stage.code.ramp(step=0.125),
            "add": stage.code.add,
            "left": lib.block("gain")(k=0.5),
            "right": lib.block("square_root"),
            "size": lib.block("absolute"),
        },
        cells={"a": ["wave.y", "add.a"], "b": ["ramp.y", "add.b"], "c": ["add.y", "left.u", "size.u"], "d": ["size.y", "right.u"]},
        place={"wave": "0.fast", "ramp": "1.fast", "add": "2.soft", "left": "0.soft", "size": "1.soft", "right": "2.low"},
        record={"left": "left.y", "right": "right.y"},
        start=[
            *(activate(label) for label in ("add", "left", "size", "right")),
            activate("wave", every="2 ms"),
            activate("ramp", every="2 ms"),
        ],
    )
