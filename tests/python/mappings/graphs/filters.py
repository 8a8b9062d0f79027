# SPDX-License-Identifier: Apache-2.0
"""Filters and other blocks with a memory, each on a different processor from its input."""

from __future__ import annotations

from mappings.graph import LENGTH, Graph, Model, Stage, graph, scattered
from opengpac import activate
from opengpac import library as lib


def _filtering(stage: Stage, use: object, seed: int = 40503) -> Graph:
    """Returns scattered values into one block elsewhere, which is recorded on a third processor."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=seed), "it": use},
        cells={"u": ["wave.y", "it.u"]},
        place={"wave": "0.fast", "it": "1.soft", "record_y": "2.soft"},
        record={"y": "it.y"},
        start=[activate("it"), activate("wave", every="2 ms")],
    )


def _delayed() -> Model:
    return {"y": [0.25] * 7 + scattered()[: LENGTH - 7]}


@graph(_delayed)
def delay_line_elsewhere(stage: Stage) -> Graph:
    """The value from seven invocations ago."""
    return _filtering(stage, lib.block("delay_line")(delay=7, initial=0.25))


@graph()
def biquad_elsewhere(stage: Stage) -> Graph:
    """A second-order section."""
    return _filtering(stage, lib.block("biquad")(b0=0.2, b1=0.4, b2=0.2, a1=-0.5, a2=0.3))


@graph()
def transfer_function_elsewhere(stage: Stage) -> Graph:
    """A transfer function of third order."""
    return _filtering(stage, lib.block("transfer_function")(n=4, b=[0.1, 0.2, 0.2, 0.1], a=[1.0, -0.6, 0.3, -0.05]))


@graph()
def median_then_moving_average(stage: Stage) -> Graph:
    """Two windows in series, on two processors."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=51),
            "median": lib.block("median")(window=5),
            "mean": lib.block("moving_average")(window=8),
        },
        cells={"u": ["wave.y", "median.u"], "m": ["median.y", "mean.u"]},
        place={"wave": "0.fast", "median": "1.soft", "mean": "2.soft"},
        record={"median": "median.y", "mean": "mean.y"},
        start=[activate("mean"), activate("median"), activate("wave", every="2 ms")],
    )


@graph()
def state_space_of_two_inputs(stage: Stage) -> Graph:
    """A state-space system whose two inputs are written on two processors."""
    return Graph(
        blocks={
            "u": stage.code.scatter(seed=52),
            "w": stage.code.scatter(seed=53),
            "it": lib.block("state_space")(
                n=2, a=[[0.9, 0.1, 0, 0, 0, 0, 0, 0], [-0.1, 0.8, 0, 0, 0, 0, 0, 0]], b=[1.0, 0.5], c=[1.0, -1.0], d=0.1, e=[0.0, 1.0]
            ),
        },
        cells={"u": ["u.y", "it.u"], "w": ["w.y", "it.w"]},
        place={"u": "0.fast", "w": "1.fast", "it": "2.soft"},
        record={"y": "it.y"},
        start=[activate("it"), activate("u", every="2 ms"), activate("w", every="2 ms")],
    )


def _shaped() -> Model:
    shaped = []
    for u in scattered(54):
        bent = 2.0 * u
        dead = bent - 0.25 if bent > 0.25 else bent + 0.25 if bent < -0.25 else 0.0
        shaped.append(dead)
    return {"dead": shaped}


@graph(_shaped)
def shapes_in_a_row(stage: Stage) -> Graph:
    """A gain, a dead band, steps and a sign, each on a different source from the previous one."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=54),
            "gain": lib.block("gain")(k=2.0),
            "dead": lib.block("dead_band")(width=0.25),
            "steps": lib.block("quantizer")(step=0.125),
            "sign": lib.block("sign"),
        },
        cells={"a": ["wave.y", "gain.u"], "b": ["gain.y", "dead.u"], "c": ["dead.y", "steps.u"], "d": ["steps.y", "sign.u"]},
        place={"wave": "0.fast", "gain": "1.soft", "dead": "2.soft", "steps": "3.soft", "sign": "1.low"},
        record={"dead": "dead.y", "steps": "steps.y", "sign": "sign.y"},
        start=[*(activate(label) for label in ("sign", "steps", "dead", "gain")), activate("wave", every="2 ms")],
    )


def _looked_up() -> Model:
    xs, ys = [-0.5, -0.1, 0.2, 0.5], [1.0, -1.0, 3.0, 0.0]

    def at(u: float) -> float:
        i = sum(x <= u for x in xs[1:-1])
        return ys[i] + (ys[i + 1] - ys[i]) * ((u - xs[i]) / (xs[i + 1] - xs[i]))

    return {"y": [at(u) for u in scattered(55)]}


@graph(_looked_up)
def table_elsewhere(stage: Stage) -> Graph:
    """A table lookup on another processor."""
    return _filtering(stage, lib.block("lookup_table")(n=4, xs=[-0.5, -0.1, 0.2, 0.5], ys=[1.0, -1.0, 3.0, 0.0]), seed=55)


@graph()
def statistics_of_a_window(stage: Stage) -> Graph:
    """Mean, variance and extremes of the last 16 values, each recorded on another processor."""
    outputs = ("mean", "variance", "least", "greatest")
    return Graph(
        blocks={"wave": stage.code.scatter(seed=56), "of": lib.block("statistics")(window=16)},
        cells={"u": ["wave.y", "of.u"]},
        place={"wave": "0.fast", "of": "1.soft", **{f"record_{name}": f"{n}.soft" for n, name in enumerate(outputs)}},
        record={name: f"of.{name}" for name in outputs},
        start=[activate("of"), activate("wave", every="2 ms")],
    )


@graph()
def noise_of_a_seed(stage: Stage) -> Graph:
    """Noise of the library, a sequence determined by its seed, drives a running mean elsewhere."""
    return Graph(
        blocks={"noise": lib.block("noise")(distribution=1, deviation=2.0, seed=12345), "of": lib.block("running_statistics")},
        cells={"u": ["noise.y", "of.u"]},
        place={"noise": "0.fast", "of": "1.soft"},
        record={"noise": "noise.y", "mean": "of.mean", "rms": "of.rms"},
        start=[activate("of"), activate("noise", every="2 ms")],
    )
