# SPDX-License-Identifier: Apache-2.0
"""Requirement 39 with DESIGN 2.1: an array port takes a list of SVVs, through graphs and across sources; struct ports take structs."""

from __future__ import annotations

import pytest

import opengpac as gpac
from opengpac import activate
from rig import Rig


def test_r039_array_ports_take_lists_of_svvs_through_graphs_and_sources(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    inputs, outputs = rig.svvs("a", "b", "c"), rig.svvs("x", "y", "z")
    inner = gpac.Graph("inner", blocks={"scale": rig.block("pose.triple")}, inputs={"u": "scale.u"}, outputs={"y": "scale.y"})
    outer = gpac.Graph("outer", blocks={"inner": inner}, inputs={"u": "inner.u"}, outputs={"y": "inner.y"})
    scaling = gpac.Verb(
        "scaling",
        blocks={"g": outer},
        instantiation_parameters={"u": "g.u", "y": "g.y"},
        command_lists={"start": [activate("g", every="1 ms")]},
    )
    scaling.on(other).asynch(inputs, outputs)
    for svv, value in zip(inputs, (1.0, 2.0, 3.0), strict=True):
        svv.value = value
    rig.cell.advance("5 ms")
    assert [svv.value for svv in outputs] == [3, 6, 9]
    reading = gpac.Verb(
        "reading",
        blocks={"s": rig.block("pose.triple")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s", every="1 ms")]},
    )
    whole = rig.cell.svv("whole", "double[3]")
    reading.on(rig.fast).asynch([outputs[2], outputs[0], outputs[2]], whole)
    rig.cell.advance("5 ms")
    assert whole.value.tolist() == [27, 9, 27], "in any order, one of them twice, from another source"


def test_r039_a_list_of_synchronous_values_from_several_sources_makes_one_invocation(rig: Rig) -> None:
    rtp1 = rig.cell.processor("rtp1")
    beside, soft = rtp1.timer("beside", period="1 ms", priority=80), rtp1.software("soft", priority=50)
    third = rig.cell.processor("rtp2").timer("third", period="1 ms", priority=70)
    svvs = rig.svvs("a", "b", "c")
    sums = rig.cell.svv("sums", "double[3]", history=500)
    writers = [
        rig.counting(f"count{k}").on(source).new_instance(svv)
        for k, (source, svv) in enumerate(zip((rig.fast, beside, third), svvs, strict=True))
    ]
    adding = gpac.Verb(
        "adding",
        blocks={"s": rig.block("pose.triple_sync")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s")]},
    )
    adding.on(soft).asynch(svvs, sums)
    for writer in writers:
        writer.start()
        rig.cell.advance("2 ms")
    rig.cell.advance("100 ms")
    rows = sums.history[:]["value"]
    assert len(rows) > 95
    assert all(row.tolist() == [3 * k] * 3 for k, row in enumerate(rows)), "one value of each, by order, none lost and none doubled"


def test_r039_a_struct_goes_through_a_graph_and_across_sources(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    turn = rig.block("pose.turn")
    pose = turn.types["pose"]
    before, after = (rig.cell.svv(name, pose) for name in ("before", "after"))
    graph = gpac.Graph(
        "twice",
        blocks={"one": turn, "two": turn},
        inputs={"before": "one.before"},
        outputs={"after": "two.after"},
        cells={"between": ["one.after", "two.before"]},
    )
    turning = gpac.Verb(
        "turning",
        blocks={"g": graph},
        instantiation_parameters={"before": "g.before", "after": "g.after"},
        command_lists={"start": [activate("g", every="1 ms")]},
    )
    turning.on({"g.one": rig.fast, "g.two": other}).asynch(before, after)
    before.value = {"p": [1.0, 2.0, 3.0], "yaw": 0.25}
    rig.cell.advance("5 ms")
    assert after.value["yaw"] == pytest.approx(1.25) and after.value["p"].tolist() == [1, 2, 3]
