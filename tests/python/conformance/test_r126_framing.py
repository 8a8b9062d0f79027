# SPDX-License-Identifier: Apache-2.0
"""Requirements 119 and 127 to 130: simple verbs, configuration and change from one interface, modules, SVVs of the user's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import opengpac as gpac
from opengpac import activate, execute
from opengpac import library as lib
from rig import Rig


def test_r119_a_verb_with_one_list_is_simple(memory_rig: Rig) -> None:
    lists = {"a": [activate("count", every="1 ms")], "b": [execute("count")]}
    assert memory_rig.counting("one_list").simple and repr(memory_rig.counting("one_list")).startswith("simple verb one_list")
    two = memory_rig.counting("two_lists", command_lists=lists, initial="a", transitions={("a", "enough"): "b"})
    assert not two.simple and repr(two).startswith("verb two_lists")


def test_r127_hardware_is_configured_while_verbs_run(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance("5 ms")
    added = rig.cell.processor("added").timer("tick", period="1 ms", priority=40)
    drive = added.processor.physical_device("drive", gpac.drivers.loopback("x"), exchange=added)
    rig.counting().on(added).asynch(b)
    rig.cell.advance("5 ms")
    assert (a.value, b.value, drive.parts) == (9, 4, ["x"])


def test_r128_a_module_is_a_library_of_subroutines(memory_rig: Rig, tmp_path: Path) -> None:
    source = tmp_path / "two.c"
    one = 'FUNCTION_BLOCK({0}, "y = {1} u.", in(double, u, "value"), out(double, y, "result")) {{ self->y = {1} * self->u; return OK; }}\n'
    source.write_text("#include <opengpac.h>\n" + one.format("twice", 2) + one.format("thrice", 3))
    module = memory_rig.cell.download(source)
    assert [block.name for block in module] == ["two.twice", "two.thrice"]
    assert [block.run(u=[1.0]).y[0] for block in module] == [2.0, 3.0]


def test_r129_svvs_stand_alone_and_a_device_needs_no_verb(rig: Rig) -> None:
    class Lamp(gpac.LogicalDevice):
        """Lamp that needs no verb."""

        brightness: gpac.SVV[float] = gpac.svv(initial=0.0)

    lamp = Lamp("lamp", system=rig.cell)
    dimming = gpac.Verb(
        "dimming",
        blocks={"level": lib.block("signal_generator")(shape=0)},
        objects={"lamp": Lamp},
        instantiation_parameters={"lamp.brightness": "level.y"},
        input_parameters={"to": "level.offset"},
        command_lists={"start": [execute("level")]},
    )
    lamp.enable()
    dimming.on(rig.slow)(lamp, to=0.7)
    alone = rig.cell.svv("alone", initial=1.5)
    assert (lamp.brightness.value, alone.value) == (0.7, 1.5)


def test_r130_behaviour_changes_while_the_rest_runs_on(rig: Rig) -> None:
    steady, changing = rig.cell.svv("steady", history=1000), rig.cell.svv("changing")
    going = rig.counting().on(rig.fast).asynch(steady)
    rig.counting("work").on(rig.fast)(changing, limit=3)
    before = steady.value
    rig.counting("work", blocks={"count": rig.block("count.count")}, command_lists={"start": [activate("count", every="10 ms")]}).on(
        rig.slow
    )(changing, limit=2)
    assert changing.value == 2
    assert going.state == "running"
    # One each millisecond, except for those that a busy machine skips.
    rig.until(lambda: steady.value >= before + 20, "it runs on")
    assert (np.diff(steady.history[:]["value"]) == 1).all(), "no invocation is lost, none begins anew"
