# SPDX-License-Identifier: Apache-2.0
"""Arrays: one port over several SVVs, gathered and scattered, and kinematics."""

from __future__ import annotations

from functools import cache

import opengpac as gpac
from mappings.graph import Graph, Stage, graph, scattered
from opengpac import activate
from opengpac import library as lib


@graph(lambda: {"y": [[3.0 * row[i] for i in range(4)] for row in zip(*(scattered(n) for n in range(4)), strict=True)]})
def gather_of_one_source(stage: Stage) -> Graph:
    """Four SVVs of one source form one array of a block on another processor."""
    return Graph(
        blocks={**{f"wave{n}": stage.code.scatter(seed=n) for n in range(4)}, "times": stage.code.times(k=3.0, n=4)},
        cells={},
        objects={**{f"u{n}": f"wave{n}.y" for n in range(4)}, "u": "times.u", "y": "times.y"},
        svvs={"y": "double[4]"},
        arguments=_four(stage),
        place={**{f"wave{n}": "0.fast" for n in range(4)}, "times": "1.soft"},
        record={"y": "times.y"},
        recorder={"y": "record_vector"},
        start=[activate("times"), *(activate(f"wave{n}", every="2 ms") for n in range(4))],
    )


@graph()
def gather_of_two_processors(stage: Stage) -> Graph:
    """Two SVVs of each of two processors form one array of a block on a third."""
    return Graph(
        blocks={**{f"wave{n}": stage.code.scatter(seed=n) for n in range(4)}, "times": stage.code.times(k=-1.0, n=4)},
        cells={},
        objects={**{f"u{n}": f"wave{n}.y" for n in range(4)}, "u": "times.u", "y": "times.y"},
        svvs={"y": "double[4]"},
        arguments=_four(stage),
        place={**{f"wave{n}": f"{n % 2}.fast" for n in range(4)}, "times": "2.soft"},
        record={"y": "times.y"},
        recorder={"y": "record_vector"},
        start=[activate("times"), *(activate(f"wave{n}", every="2 ms") for n in range(4))],
    )


def _four(stage: Stage) -> dict[str, object]:
    single = [stage.svv(f"u{n}") for n in range(4)]
    return {**{f"u{n}": svv for n, svv in enumerate(single)}, "u": single}


@graph(lambda: {f"y{n}": [10.0 * (k + n / 8) for k in range(200)] for n in range(4)})
def scatter_to_four_processors(stage: Stage) -> Graph:
    """The elements of one array are four SVVs, each read on its own processor."""
    single = [stage.svv(f"v{n}") for n in range(4)]
    return Graph(
        blocks={"vector": stage.code.vector, **{f"gain{n}": lib.block("gain")(k=10.0) for n in range(4)}},
        cells={},
        objects={"v": "vector.v", **{f"v{n}": f"gain{n}.u" for n in range(4)}},
        arguments={"v": single, **{f"v{n}": svv for n, svv in enumerate(single)}},
        place={"vector": "0.fast", **{f"gain{n}": f"{n}.soft" for n in range(4)}},
        record={f"y{n}": f"gain{n}.y" for n in range(4)},
        start=[*(activate(f"gain{n}") for n in range(4)), activate("vector", every="2 ms")],
    )


@graph(lambda: {"y": [[3.0 * row[i] for i in range(4)] for row in zip(*(scattered(n) for n in range(4)), strict=True)]})
def elements_of_two_processors_in_cells(stage: Stage) -> Graph:
    """Outputs of blocks on two processors are elements of one array port on a third, by cells."""
    return Graph(
        blocks={**{f"wave{n}": stage.code.scatter(seed=n) for n in range(4)}, "times": stage.code.times(k=3.0)},
        cells={f"u{n}": [f"wave{n}.y", f"times.u[{n}]"] for n in range(4)},
        objects={"y": "times.y"},
        svvs={"y": "double[4]"},
        place={**{f"wave{n}": f"{n % 2}.fast" for n in range(4)}, "times": "2.soft"},
        record={"y": "times.y"},
        recorder={"y": "record_vector"},
        start=[activate("times"), *(activate(f"wave{n}", every="2 ms") for n in range(4))],
    )


@graph(lambda: {f"y{n}": [10.0 * (k + n / 8) for k in range(200)] for n in range(4)})
def elements_to_four_processors_in_cells(stage: Stage) -> Graph:
    """The elements of an output go to blocks on four processors, by cells."""
    return Graph(
        blocks={"vector": stage.code.vector, **{f"gain{n}": lib.block("gain")(k=10.0) for n in range(4)}},
        cells={f"v{n}": [f"vector.v[{n}]", f"gain{n}.u"] for n in range(4)},
        place={"vector": "0.fast", **{f"gain{n}": f"{n}.soft" for n in range(4)}},
        record={f"y{n}": f"gain{n}.y" for n in range(4)},
        start=[*(activate(f"gain{n}") for n in range(4)), activate("vector", every="2 ms")],
    )


@graph()
def vector_from_processor_to_processor(stage: Stage) -> Graph:
    """A whole array travels over three processors."""
    return Graph(
        blocks={"vector": stage.code.vector, "a": stage.code.times(k=0.1, n=4), "b": stage.code.times(k=0.3, n=4)},
        cells={"u": ["vector.v", "a.u"], "v": ["a.y", "b.u"]},
        place={"vector": "0.fast", "a": "1.soft", "b": "2.soft"},
        record={"y": "b.y"},
        recorder={"y": "record_vector"},
        start=[activate("a"), activate("b"), activate("vector", every="2 ms")],
    )


@graph()
def greatest_and_least_of_several_writers(stage: Stage) -> Graph:
    """The maximum and the product of three SVVs that three processors write."""
    single = [stage.svv(f"u{n}") for n in range(3)]
    return Graph(
        blocks={
            **{f"wave{n}": stage.code.scatter(seed=7 + n) for n in range(3)},
            "greatest": lib.block("maximum")(n=3),
            "product": lib.block("product")(n=3),
        },
        cells={},
        objects={**{f"u{n}": f"wave{n}.y" for n in range(3)}, "u": ["greatest.u", "product.u"]},
        arguments={**{f"u{n}": svv for n, svv in enumerate(single)}, "u": single},
        place={**{f"wave{n}": f"{n}.fast" for n in range(3)}, "greatest": "3.soft", "product": "3.soft"},
        record={"greatest": "greatest.y", "product": "product.y"},
        start=[activate("greatest"), activate("product"), *(activate(f"wave{n}", every="2 ms") for n in range(3))],
    )


@cache
def _chain() -> object:
    with gpac.System("geometry of an arm", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms")
        return gpac.robots.load("ur5e", on=fast).chain


@graph()
def pose_of_an_arm_elsewhere(stage: Stage) -> Graph:
    """Joint positions on one processor and the pose of the tool on another."""
    return Graph(
        blocks={"joints": stage.code.six_joints, "pose": lib.block("forward_kinematics")(n=6)},
        cells={"q": ["joints.q", "pose.q"]},
        inputs={"chain": "pose.chain"},
        values={"chain": _chain()},
        place={"joints": "0.fast", "pose": "1.soft"},
        record={"pose": "pose.pose"},
        recorder={"pose": "record_pose"},
        start=[activate("pose"), activate("joints", every="2 ms")],
    )


@graph()
def singularity_of_an_arm_elsewhere(stage: Stage) -> Graph:
    """Distance of an arm from a singularity: its Jacobian on one processor, the derived value on another."""
    return Graph(
        blocks={
            "joints": stage.code.six_joints,
            "jacobian": lib.block("jacobian")(n=6),
            "pose": lib.block("forward_kinematics")(n=6),
            "near": lib.block("hysteresis")(lower=0.02, upper=0.05),
        },
        cells={"q": ["joints.q", "jacobian.q", "pose.q"], "least": ["jacobian.least", "near.u"]},
        inputs={"chain": ["jacobian.chain", "pose.chain"]},
        values={"chain": _chain()},
        place={"joints": "0.fast", "jacobian": "1.soft", "pose": "2.soft", "near": "2.low"},
        record={"least": "jacobian.least", "near": "near.y", "pose": "pose.pose"},
        recorder={"pose": "record_pose"},
        start=[activate("near"), activate("pose"), activate("jacobian"), activate("joints", every="2 ms")],
    )
