# SPDX-License-Identifier: Apache-2.0
"""Graphs inside graphs, whose inner blocks are placed on different processors."""

from __future__ import annotations

import opengpac as gpac
from mappings.graph import Graph, Model, Stage, graph, scattered
from opengpac import activate
from opengpac import library as lib


def _smooth(name: str = "smooth", k: float = 2.0, alpha: float = 0.5) -> gpac.Graph:
    """Returns a gain and a low-pass filter in series."""
    return gpac.Graph(
        name,
        blocks={"gain": lib.block("gain")(k=k), "low": lib.block("lowpass")(alpha=alpha)},
        inputs={"u": "gain.u"},
        outputs={"y": "low.y"},
        cells={"scaled": ["gain.y", "low.u"]},
    )


def _low(values: list[float], k: float, alpha: float) -> list[float]:
    found, y = [], 0.0
    for u in values:
        y += alpha * (k * u - y)
        found.append(y)
    return found


@graph(lambda: {"y": _low(scattered(), 2.0, 0.5)})
def graph_on_two_processors(stage: Stage) -> Graph:
    """The gain of a graph runs on one processor, its filter on another."""
    return Graph(
        blocks={"wave": stage.code.scatter, "law": _smooth()},
        cells={"u": ["wave.y", "law.u"]},
        place={"wave": "0.fast", "law.gain": "1.soft", "law.low": "2.soft", "record_y": "2.soft"},
        record={"y": "law.y"},
        start=[activate("law"), activate("wave", every="2 ms")],
    )


def _twice_model() -> Model:
    return {"y": _low(_low(scattered(), 2.0, 0.5), 0.5, 0.25)}


@graph(_twice_model)
def graph_in_a_graph(stage: Stage) -> Graph:
    """Two graphs in one; all four blocks run on different sources of three processors."""
    twice = gpac.Graph(
        "twice",
        blocks={"first": _smooth(), "second": _smooth("again", 0.5, 0.25)},
        inputs={"u": "first.u"},
        outputs={"y": "second.y"},
        cells={"between": ["first.y", "second.u"]},
    )
    return Graph(
        blocks={"wave": stage.code.scatter, "law": twice},
        cells={"u": ["wave.y", "law.u"]},
        place={
            "wave": "0.fast", "law.first.gain": "1.soft", "law.first.low": "2.soft", "law.second.gain": "1.low",
            "law.second.low": "0.soft", "record_y": "0.soft",
        },
        record={"y": "law.y"},
        start=[activate("law"), activate("wave", every="2 ms")],
    )  # fmt: skip


@graph()
def graph_that_begins_and_ends_itself(stage: Stage) -> Graph:
    """A graph with its own stimuli on two processors, nested three levels deep."""
    inner = gpac.Graph(
        "sources",
        blocks={"a": stage.code.scatter(seed=41), "b": stage.code.ramp(step=0.01)},
        outputs={"a": "a.y", "b": "b.y"},
    )
    middle = gpac.Graph(
        "summed",
        blocks={"sources": inner, "add": stage.code.add},
        outputs={"y": "add.y"},
        cells={"a": ["sources.a", "add.a"], "b": ["sources.b", "add.b"]},
    )
    outer = gpac.Graph(
        "scaled",
        blocks={"summed": middle, "gain": lib.block("gain")(k=4.0)},
        outputs={"y": "gain.y"},
        cells={"s": ["summed.y", "gain.u"]},
    )
    return Graph(
        blocks={"it": outer},
        cells={},
        place={
            "it.summed.sources.a": "0.fast",
            "it.summed.sources.b": "1.fast",
            "it.summed.add": "2.soft",
            "it.gain": "0.soft",
            "record_y": "1.soft",
        },
        record={"y": "it.y"},
        start=[activate("it", every="2 ms")],
    )


@graph()
def one_graph_twice(stage: Stage) -> Graph:
    """Two uses of one graph with the same stimulus, placed differently."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=43), "a": _smooth(), "b": _smooth()},
        cells={"u": ["wave.y", "a.u", "b.u"]},
        place={
            "wave": "0.fast", "a.gain": "0.fast", "a.low": "1.soft", "b.gain": "1.soft", "b.low": "2.soft",
            "record_a": "0.soft", "record_b": "0.soft",
        },
        record={"a": "a.y", "b": "b.y"},
        start=[activate("a"), activate("b"), activate("wave", every="2 ms")],
    )  # fmt: skip


@graph()
def graph_with_a_filter_inserted(stage: Stage) -> Graph:
    """An edited graph with a limit between its gain and its filter, on its own processor."""
    careful = _smooth().insert("limit", lib.block("limit")(low=-0.5, high=0.5), between=("gain.y", "low.u"))
    return Graph(
        blocks={"wave": stage.code.scatter(seed=44), "law": careful},
        cells={"u": ["wave.y", "law.u"]},
        place={"wave": "0.fast", "law.gain": "1.soft", "law.limit": "2.soft", "law.low": "1.low", "record_y": "1.low"},
        record={"y": "law.y"},
        start=[activate("law"), activate("wave", every="2 ms")],
    )
