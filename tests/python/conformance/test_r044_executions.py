# SPDX-License-Identifier: Apache-2.0
"""Paper: a block with a synchronous input "can be scheduled only when a new value is made available by another instance"."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, execute
from rig import Rig


def counted(rig: Rig, name: str, commands: list[gpac.Command], blocks: dict[str, Any] | None = None) -> gpac.Verb[..., gpac.Report]:
    """Returns a counter that drives a copier, which counts its own invocations into `n`."""
    return gpac.Verb(
        name,
        blocks=blocks or {"c": rig.block("count.count"), "k": rig.block("copy.copy")},
        instantiation_parameters={"y": "k.y", "n": "k.n"},
        cells={"w": ["c.y", "k.u"]},
        command_lists={"start": commands},
    )


@pytest.mark.parametrize("before", [[], [execute("c")], [activate("k"), execute("c")]], ids=["alone", "after its writer", "while it waits"])
def test_r044_what_waits_for_a_value_is_not_executed(memory_rig: Rig, before: list[gpac.Command]) -> None:
    with pytest.raises(
        gpac.SchedulingError, match=r"executes 'k', but input 'k.u' .* an execution brings it no new value; put it into a graph"
    ):
        counted(memory_rig, "executed", [*before, execute("k")])


def test_r044_a_graph_of_what_waits_is_not_executed(memory_rig: Rig) -> None:
    copier = gpac.Graph("copier", blocks={"c": memory_rig.block("copy.copy")}, inputs={"u": "c.u"}, outputs={"y": "c.y", "n": "c.n"})
    with pytest.raises(gpac.SchedulingError, match=r"executes 'k', but input 'k.c.u' \(double\) is synchronous"):
        counted(memory_rig, "executed", [execute("k")], {"c": memory_rig.block("count.count"), "k": copier})


def test_r044_a_graph_runs_what_waits_for_nobody_and_then_what_that_drives(rig: Rig) -> None:
    graph = gpac.Graph(
        "both",
        blocks={"c": rig.block("count.count"), "k": rig.block("copy.copy"), "other": rig.block("copy.copy")},
        inputs={"u": "other.u"},
        outputs={"y": "k.y", "n": "k.n", "others": "other.n"},
        cells={"w": ["c.y", "k.u"]},
    )
    verb = gpac.Verb(
        "executed",
        blocks={"g": graph},
        instantiation_parameters={"u": "g.u", "y": "g.y", "n": "g.n", "others": "g.others"},
        command_lists={"start": [execute("g"), execute("g"), execute("g")]},
    )
    u, y = rig.svvs("u", "y", initial=7.0)
    n, others = (rig.cell.svv(name, "int64_t", initial=-1) for name in ("n", "others"))
    verb.on(rig.fast)(u, y, n, others)
    assert (y.value, n.value) == (2.0, 3), "each execute is one invocation of the counter and one of what it drives"
    assert others.value == -1, "nothing new has come to this one"


def test_r044_a_value_that_is_executed_is_new_to_what_waits_for_it(rig: Rig) -> None:
    (y,) = rig.svvs("y", initial=-1.0)
    n = rig.cell.svv("n", "int64_t", initial=-1)
    counted(rig, "driven", [activate("k"), execute("c")]).on(rig.fast).asynch(y, n)
    rig.cell.advance("5 ms")
    assert (y.value, n.value) == (0.0, 1), "one value, one invocation"


@pytest.mark.parametrize("block", ["copy.copy", "ratio.slow_input"])
def test_r045_what_input_parameters_store_drives_nobody(rig: Rig, block: str) -> None:
    (y,) = rig.svvs("y")
    given = {"blocks": {"k": rig.block(block)}, "instantiation_parameters": {"y": "k.y"}, "input_parameters": {"u": "k.u"}}
    commands = {"start": [activate("k", every="1 ms")]}
    with pytest.raises(gpac.SchedulingError, match=r"nothing drives input 'k.u' .* only the input parameter 'u' stores into it"):
        gpac.Verb("given", command_lists=commands, **given)
    gpac.Verb("relaxed", command_lists=commands, modes={"k.u": "asynchronous"}, **given).on(rig.fast).asynch(y, u=3.0)
    rig.cell.advance("2 ms")
    assert y.value == 3.0
