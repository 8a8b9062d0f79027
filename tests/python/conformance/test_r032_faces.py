# SPDX-License-Identifier: Apache-2.0
"""The outside of a graph: the same as that of a subroutine; and A4: one mode per port."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import opengpac as gpac
from opengpac import library as lib
from rig import Rig


def chain() -> gpac.Graph:
    inner = gpac.Graph(
        "inner", blocks={"gain": lib.gain(k=2.0)}, inputs={"u": "gain.u"}, outputs={"y": "gain.y"}, modes={"u": "asynchronous"}
    )
    return gpac.Graph(
        "chain",
        blocks={"inner": inner, "filter": lib.lowpass(alpha=0.5), "bound": lib.limit(high=3.0)},
        inputs={"u": "inner.u"},
        outputs={"y": "bound.y"},
        cells={"a": ["inner.y", "filter.u"], "b": ["filter.y", "bound.u"]},
    )


def test_r032_a_graph_shows_what_a_subroutine_shows(memory_rig: Rig) -> None:
    graph, block = chain(), lib.lowpass
    for face in ("inputs", "outputs", "devices", "conditions", "parameters", "items", "doc", "run"):
        assert hasattr(graph, face) and hasattr(block, face), face
    assert (graph.inputs["u"].mode, graph.inputs["u"].type, graph.outputs["y"].kind) == ("asynchronous", "double", "output")
    assert (block.inputs["u"].mode, chain().blocks["filter"].block.inputs["u"].mode) == ("synchronous", "synchronous")
    assert graph.inputs["u"] == ["inner.u"] and copy.deepcopy(graph.inputs["u"]) == ["inner.u"]
    assert {"inner.gain.k", "filter.alpha", "bound.high"} <= {*graph.parameters} and [*graph.conditions] == ["bound.limited"]
    assert graph.conditions["bound.limited"].type == lib.limit.conditions["limited"].type and not graph.devices
    reading = gpac.Graph("reading", blocks={"read": lib.read_channel}, outputs={"y": "read.y"})
    assert [(name, item.kind) for name, item in reading.devices.items()] == [("read.channel", "device_read")]


def test_r032_a_graph_is_tried_as_a_subroutine_is(memory_rig: Rig) -> None:
    u = np.linspace(0.0, 4.0, 20)
    tried = chain().run(None, "1 ms", **{"u": u, "filter.alpha": 0.25})
    wanted = np.minimum(lib.lowpass.run(alpha=0.25, u=2.0 * u).y, 3.0)
    assert np.array_equal(tried.y, wanted)
    assert tried.conditions and {name for _, name, _ in tried.conditions} == {"bound.limited"}
    assert chain().run(u=1.0, steps=3).y.shape == (3,)
    with pytest.raises(gpac.CallError, match="no input or parameter 'v'"):
        chain().run(v=1.0)


def test_r032_a_graph_that_needs_a_system_says_so(memory_rig: Rig) -> None:
    loop = gpac.Graph(
        "loop",
        blocks={"a": lib.gain, "b": lib.gain},
        cells={"x": ["a.y", "b.u"], "y": ["b.y", "a.u"]},
        modes={"a.u": "asynchronous"},
    )
    with pytest.raises(gpac.CallError, match="its blocks 'a', 'b' form a loop; run it in a verb"):
        loop.run(steps=2)


def test_r032_a_port_of_a_graph_has_one_mode(memory_rig: Rig) -> None:
    blocks = {"a": memory_rig.block("copy.copy"), "b": memory_rig.block("copy.sample")}
    with pytest.raises(
        gpac.SchedulingError, match=r"input 'a.u' .* is synchronous, and input 'b.u' .* is asynchronous: a port has one mode"
    ):
        gpac.Graph("two", blocks=blocks, inputs={"u": ["a.u", "b.u"]}, outputs={"y": "a.y", "z": "b.y"})
    relaxed = gpac.Graph(
        "one", blocks=blocks, inputs={"u": ["a.u", "b.u"]}, outputs={"y": "a.y", "z": "b.y"}, modes={"a.u": "asynchronous"}
    )
    assert relaxed.inputs["u"].mode == "asynchronous"
