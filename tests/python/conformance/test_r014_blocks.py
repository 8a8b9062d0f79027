# SPDX-License-Identifier: Apache-2.0
"""Requirements 14 to 28: function blocks and their instances."""

from __future__ import annotations

import pytest

import opengpac as gpac
from opengpac import activate, execute
from opengpac import library as lib
from rig import Rig


def test_r014_an_interface_has_five_components(rig: Rig) -> None:
    block = rig.block("count.count")
    assert [*block.outputs] == ["y"]
    assert [*block.conditions] == ["enough"]
    assert not (block.inputs or block.devices or block.parameters)
    assert [*lib.block("read_channel").devices] == ["channel"]
    assert "alpha" in lib.block("lowpass").parameters


def test_r015_a_block_is_used_by_its_interface_alone(rig: Rig) -> None:
    assert "u" in repr(lib.block("gain")) and lib.block("gain").doc


def test_r016_a_block_is_assigned_to_several_processors(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    a, b = rig.svvs("a", "b")
    counting = rig.counting()
    counting.on(rig.fast).asynch(a)
    counting.on(other).asynch(b)
    rig.cell.advance("3 ms")
    assert a.value == b.value == 2


def test_r017_a_block_reports_conditions_with_values(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    report = rig.counting().on(rig.fast)(a, limit=4)
    assert (report.condition, report.value, report.last) == ("enough", 4, 4)


def test_r018_parameters_have_defaults_and_stay_inside(rig: Rig) -> None:
    u, y = rig.svvs("u", "y")
    scaling = gpac.Verb(
        "scaling",
        blocks={"gain": lib.block("gain")(k=3.0)},
        instantiation_parameters={"u": "gain.u", "y": "gain.y"},
        modes={"gain.u": "asynchronous"},
        command_lists={"start": [execute("gain")]},
    )
    u.value = 2.0
    scaling.on(rig.fast)(u, y)
    assert y.value == 6.0


def test_r019_a_subroutine_is_a_c_function(rig: Rig) -> None:
    assert lib.block("lowpass").run(alpha=0.5, u=[1.0, 1.0, 1.0]).y.tolist() == [0.5, 0.75, 0.875]


def test_r020_the_interface_is_declared_by_macros(memory_rig: Rig, tmp_path) -> None:
    source = tmp_path / "twice.c"
    source.write_text(
        '#include <opengpac.h>\nFUNCTION_BLOCK(twice, "y = 2 u.", in(double, u, "value", "rad"), out(double, y, "twice", "rad"))\n'
        "{ self->y = 2 * self->u; return OK; }\n"
    )
    block = memory_rig.cell.download(source).twice
    assert (block.inputs["u"].unit, block.inputs["u"].type, block.inputs["u"].mode) == ("rad", "double", "synchronous")


def test_r021_a_subroutine_is_sequential(memory_rig: Rig) -> None:
    assert memory_rig.block("count.count").run(3).y.tolist() == [0, 1, 2]


def test_r022_instances_of_one_subroutine_share_nothing(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    memory = gpac.Verb(
        "remembering",
        blocks={"m": rig.block("memory.memory")},
        instantiation_parameters={"y": "m.forgets"},
        command_lists={"start": [activate("m", every="1 ms")]},
    )
    memory.on(rig.fast).asynch(a)
    rig.cell.advance("5 ms")
    memory.on(rig.fast).asynch(b)
    rig.cell.advance("5 ms")
    assert (a.value, b.value) == (10, 5)


def test_r023_several_instances_run_on_one_processor(rig: Rig) -> None:
    svvs = rig.svvs("a", "b", "c")
    counting = rig.counting()
    for svv in svvs:
        counting.on(rig.fast).asynch(svv)
    rig.cell.advance("4 ms")
    assert [svv.value for svv in svvs] == [3, 3, 3]


def test_r024_instances_run_on_different_processors(rig: Rig) -> None:
    timers = [rig.cell.processor(f"p{n}").timer("t", period="1 ms", priority=50) for n in range(3)]
    svvs = rig.svvs("a", "b", "c")
    counting = rig.counting()
    for svv, timer in zip(svvs, timers, strict=True):
        counting.on(timer).asynch(svv)
    rig.cell.advance("4 ms")
    assert [svv.value for svv in svvs] == [3, 3, 3]


def test_r025_an_instance_binds_ports_and_values(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    with rig.counting().on(rig.fast).new_instance(a) as instance:
        assert "count.count on rtp0.fast" in repr(instance)


def test_r026_an_instance_needs_a_source(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    other = memory_rig.rtp.timer("also_fast", period="1 ms", priority=81)
    with pytest.raises(gpac.PlacementError) as caught:
        memory_rig.counting().on(memory_rig.cell).new_instance(a)
    assert other.name in str(caught.value) and memory_rig.fast.name in str(caught.value), "both candidates are named"


def test_r027_an_instance_needs_its_scheduling(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    unscheduled = memory_rig.counting("unscheduled", command_lists={"start": [activate("count")]})
    with pytest.raises(gpac.SchedulingError, match="count"):
        unscheduled.on(memory_rig.fast).new_instance(a)


def test_r028_a_missing_binding_is_an_error_before_execution(memory_rig: Rig) -> None:
    with pytest.raises(gpac.CoverError, match=r"add\.b"):
        gpac.Verb(
            "uncovered",
            blocks={"add": memory_rig.block("copy.add"), "count": memory_rig.block("count.count")},
            cells={"c": ["count.y", "add.a"]},
            command_lists={"start": [activate("count", every="1 ms"), activate("add")]},
        ).on(memory_rig.fast).new_instance()
