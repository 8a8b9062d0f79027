# SPDX-License-Identifier: Apache-2.0
"""Requirements 29 to 37: data flow graphs, and the component database."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, execute, wait
from opengpac import library as lib
from rig import Rig


def smooth(name: str = "smooth", **changes: object) -> gpac.Graph:
    """Returns a gain and a low-pass filter in series."""
    definition: dict[str, object] = {
        "blocks": {"gain": lib.block("gain")(k=2.0), "filter": lib.block("lowpass")(alpha=0.5)},
        "inputs": {"u": "gain.u"},
        "outputs": {"y": "filter.y"},
        "cells": {"scaled": ["gain.y", "filter.u"]},
    }
    return gpac.Graph(name, **{**definition, **changes})  # type: ignore[arg-type]


def feeding(block: object, source: object = None, **changes: object) -> gpac.Verb[..., gpac.Report]:
    """Returns a verb that feeds a constant 1 into the input of a block or graph, every millisecond."""
    definition: dict[str, object] = {
        "blocks": {"one": lib.block("signal_generator")(shape=0, offset=1.0), "it": block},
        "instantiation_parameters": {"y": "it.y"},
        "cells": {"u": ["one.y", "it.u"]},
        "command_lists": {"start": [activate("one", every="1 ms"), activate("it")]},
    }
    return gpac.Verb("feeding", **{**definition, **changes})  # type: ignore[arg-type]


def test_r029_a_graph_has_blocks_ports_and_cells() -> None:
    graph = smooth()
    assert ([*graph.blocks], [*graph.inputs], [*graph.outputs], [*graph.cells]) == (["gain", "filter"], ["u"], ["y"], ["scaled"])


def test_r030_rho_maps_a_port_to_a_set_of_data_nodes(rig: Rig) -> None:
    both = gpac.Graph(
        "both",
        blocks={"a": lib.block("gain")(k=2.0), "b": lib.block("gain")(k=3.0)},
        inputs={"u": ["a.u", "b.u"]},
        outputs={"y": "a.y", "z": "b.y"},
    )
    y, z = rig.svvs("y", "z")
    feeding(both, instantiation_parameters={"y": "it.y", "z": "it.z"}).on(rig.fast).asynch(y, z)
    rig.cell.advance("3 ms")
    assert (y.value, z.value) == (2.0, 3.0)


def test_r031_an_uncovered_data_node_is_refused() -> None:
    with pytest.raises(gpac.CoverError) as caught:
        smooth(cells={})
    assert "filter.u" in str(caught.value) or "gain.y" in str(caught.value)


@pytest.mark.parametrize("how", ["interval", "trigger", "execute", "driven"])
def test_r032_a_graph_stands_where_a_subroutine_does(rig: Rig, how: str) -> None:
    """However it is triggered, the values and times are the same for a subroutine, a graph of it, and a graph of that graph."""
    button = rig.rtp.trigger("button", priority=50)
    code, port = (lib.block("lowpass")(alpha=0.5), "u") if how == "driven" else (rig.block("count.count"), None)
    inner = gpac.Graph("inner", blocks={"b": code}, inputs={"u": "b.u"} if port else {}, outputs={"y": "b.y"})
    outer = gpac.Graph("outer", blocks={"i": inner}, inputs={"u": "i.u"} if port else {}, outputs={"y": "i.y"})
    found = []
    for name, block in {"subroutine": code, "graph": inner, "nested": outer}.items():
        y = rig.cell.svv(f"y_{name}", history=100)
        if how == "driven":
            verb = feeding(block).named(f"verb_{name}")
        else:
            command = {"interval": activate("it", every="2 ms"), "trigger": activate("it"), "execute": execute("it")}[how]
            verb = gpac.Verb(
                f"verb_{name}",
                blocks={"it": block},
                instantiation_parameters={"y": "it.y"},
                command_lists={"start": [command, *([wait("3 ms"), command] if how == "execute" else [])]},
            )
        rig.cell.advance("2 ms")
        begun = rig.cell.now
        instance = verb.on(button if how == "trigger" else rig.fast).asynch(y)
        for _ in range(10):
            if how == "trigger":
                button.request()
            rig.cell.advance("2 ms")
        if instance.state == "running":
            instance.halt()
        instance.wait()
        rows = y.history[:]
        found.append((rows["number"].tolist(), rows["value"].tolist(), [round((t - begun) * 1e6) for t in rows["time"]]))
    assert found[0] == found[1] == found[2]
    assert len(found[0][1]) == {"interval": 10, "trigger": 10, "execute": 2, "driven": 20}[how]


def test_r032_what_is_refused_of_a_subroutine_is_refused_of_a_graph(memory_rig: Rig) -> None:
    rig = memory_rig
    code = lib.block("lowpass")
    graph = gpac.Graph("graph", blocks={"b": code}, inputs={"u": "b.u"}, outputs={"y": "b.y"})
    wrong, y = rig.cell.svv("wrong", "float"), rig.cell.svv("y")
    attempts: list[Callable[[Any], object]] = [
        lambda block: feeding(block).on(rig.fast).new_instance(wrong),
        lambda block: feeding(block, cells={}),
        lambda block: feeding(block, instantiation_parameters={"y": ["it.y", "one.y"]}).on(rig.fast).new_instance(y),
        lambda block: feeding(block, cells={"u": ["one.y", "it.w"]}),
        lambda block: feeding(block, command_lists={"start": [activate("it")]}).on(rig.fast).new_instance(y),
        lambda block: (
            feeding(block, command_lists={"start": [activate("one", every="1 ms"), activate("it", every="1 ms")]})
            .on(rig.fast)
            .new_instance(y)
        ),
    ]
    for attempt in attempts:
        kinds = []
        for block in (code, graph):
            with pytest.raises(gpac.Error) as caught:
                attempt(block)
            kinds.append(type(caught.value))
        assert kinds[0] is kinds[1], kinds


def test_r033_graphs_nest(rig: Rig) -> None:
    twice = gpac.Graph(
        "twice",
        blocks={"first": smooth(), "second": smooth("again")},
        inputs={"u": "first.u"},
        outputs={"y": "second.y"},
        cells={"between": ["first.y", "second.u"]},
    )
    (y,) = rig.svvs("y")
    feeding(twice).on(rig.fast).asynch(y)
    rig.cell.advance("3 ms")
    first = [1.0, 1.5, 1.75]
    second = 0.0
    for value in first:
        second += 0.5 * (2 * value - second)
    assert y.value == second


def test_r034_inner_blocks_run_on_different_processors(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").software("there", priority=70)
    (y,) = rig.svvs("y")
    placed = feeding(smooth()).on({"it.filter": other, "*": rig.fast})
    instance = placed.asynch(y)
    assert "it.gain: library.gain on rtp0.fast" in repr(instance)
    assert "it.filter: library.lowpass on rtp1.there" in repr(instance)
    rig.cell.advance("20 ms")
    assert y.value > 1.5, "the value goes from one processor to the other"


def test_r035_a_subroutine_instance_runs_on_one_processor(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    (y,) = rig.svvs("y")
    instance = feeding(smooth()).on(other).asynch(y)
    lines = [line for line in repr(instance).splitlines() if "it.gain" in line]
    assert len(lines) == 1 and lines[0].endswith("on rtp1.fast")


def test_r036_a_filter_is_inserted_by_editing_the_graph_only(rig: Rig) -> None:
    graph = smooth()
    limited = graph.insert("limit", lib.block("limit")(high=1.0), between=("gain.y", "filter.u"))
    assert [*graph.blocks] == ["gain", "filter"], "the old graph is as it was"
    (y,) = rig.svvs("y")
    feeding(limited).on(rig.fast).asynch(y)
    rig.cell.advance("1 ms")
    assert y.value == 0.5, "the gain of 2 is limited to 1 before the filter"


def test_r037_the_component_data_base_is_searched() -> None:
    assert [found.value.name for found in lib.search("low-pass", "alpha")] == ["library.lowpass"]
    assert "smoothing factor" in lib.show("lowpass")
    with pytest.raises(gpac.UnknownName, match="did you mean 'lowpass'"):
        lib.block("lowpas")
