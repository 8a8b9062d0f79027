# SPDX-License-Identifier: Apache-2.0
"""Requirements 14 to 28: function blocks and their instances."""

from __future__ import annotations

import ctypes
from itertools import accumulate
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import _native, activate, execute
from opengpac import library as lib
from rig import Rig


def test_r014_an_interface_has_five_components(rig: Rig) -> None:
    block = rig.block("count.count")
    assert [*block.outputs] == ["y"]
    assert [*block.conditions] == ["enough"]
    assert not (block.inputs or block.devices or block.parameters)
    assert [*lib.block("read_channel").devices] == ["channel"]
    assert "alpha" in lib.block("lowpass").parameters


HALVES = [
    "FUNCTION_BLOCK(half, {0}, in(double, u, {1}), out(double, y, {2})) {{ self->y = self->u / 2; return OK; }}",
    "FUNCTION_BLOCK(half, {0}, in(double, u, {1}), out(double, y, {2}), state(double, kept, 0, {1}))\n"
    "{{ self->kept = self->u; self->y = self->kept - 0.5 * self->kept; return OK; }}",
]


def used(rig: Rig, block: gpac.Block | gpac.Graph, name: str) -> list[float]:
    """Returns the outputs of a block that a program uses knowing only its interface."""
    ((u, _),), ((y, _),) = block.inputs.items(), block.outputs.items()
    verb = gpac.Verb(
        name,
        blocks={"count": rig.block("count.count"), "it": block},
        instantiation_parameters={"y": f"it.{y}"},
        cells={"u": ["count.y", f"it.{u}"]},
        command_lists={"start": [activate("count", every="1 ms"), activate("it")]},
    )
    found = rig.cell.svv(f"{name}.y", history=10)
    with verb.on(rig.fast).asynch(found):
        rig.cell.advance("10 ms")
    return found.history[:]["value"].tolist()


def test_r015_a_block_is_used_by_its_interface_alone(memory_rig: Rig, tmp_path: Path) -> None:
    """Two codes with one interface, present only as machine code, and a graph: a program cannot distinguish them."""
    blocks = []
    for number, text in enumerate(HALVES):
        source = tmp_path / f"half{number}.c"
        source.write_text("#include <opengpac.h>\n" + text.format('"y = u / 2."', '"value"', '"half of it"'))
        machine_code = _native.build([str(source)], str(tmp_path / f"half{number}.so"))
        source.unlink()
        blocks.append(memory_rig.cell.download(machine_code, f"half{number}").half)
    one, other = blocks
    assert [(p.type, p.mode, p.unit) for p in one.inputs.values()] == [(p.type, p.mode, p.unit) for p in other.inputs.values()]
    graph = gpac.Graph("halving", blocks={"h": other}, inputs={"value": "h.u"}, outputs={"half": "h.y"})
    for number, block in enumerate((one, other, graph)):
        assert used(memory_rig, block, f"use{number}") == [k / 2 for k in range(10)]


def test_r015_what_is_inside_cannot_be_reached(memory_rig: Rig) -> None:
    remembers = memory_rig.block("memory.memory")
    assert {*remembers.outputs} == {"forgets", "keeps"}, "its state is not in its interface"
    for wrong in (
        {"input_parameters": {"k": "count.k"}},
        {"instantiation_parameters": {"y": "count.y", "k": "count.k"}},
        {"output_values": {"last": "count.k"}},
    ):
        with pytest.raises(gpac.Error, match=r"count\.k"):
            memory_rig.counting("inside", **wrong).on(memory_rig.fast).new_instance(*memory_rig.svvs("y"))


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


def scaling(name: str = "scaling", use: object = None, **changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb for y = k u, with the k of its block."""
    definition: dict[str, Any] = {
        "blocks": {"gain": lib.block("gain")(k=3.0) if use is None else use},
        "instantiation_parameters": {"u": "gain.u", "y": "gain.y"},
        "modes": {"gain.u": "asynchronous"},
        "command_lists": {"start": [execute("gain")]},
    }
    return gpac.Verb(name, **{**definition, **changes})


def test_r018_parameters_have_defaults_and_stay_inside(rig: Rig) -> None:
    u, y, z = rig.svvs("u", "y", "z")
    u.value = 2.0
    before = {*rig.cell.names["svvs"]}
    scaling().on(rig.fast)(u, y)
    scaling("by_default", lib.block("gain")).on(rig.fast)(u, z)
    assert (y.value, z.value) == (6.0, 2.0), "the value that is given, and the default; each in its own instance"
    assert [*scaling().signature.parameters] == ["u", "y"], "who calls the verb does not see it"
    assert {*rig.cell.names["svvs"]} == before, "it is no SVV"


def test_r018_nothing_is_wired_to_a_parameter_and_nobody_sets_it_from_outside(memory_rig: Rig) -> None:
    u, y, k = memory_rig.svvs("u", "y", "k")
    with pytest.raises(gpac.CoverError, match=r"parameter 'gain\.k' .* not a port or device"):
        scaling("bound", instantiation_parameters={"u": "gain.u", "y": "gain.y", "k": "gain.k"})
    with pytest.raises(gpac.CoverError, match=r"parameter 'gain\.k'"):
        scaling(
            "wired",
            blocks={"gain": lib.block("gain"), "count": memory_rig.block("count.count")},
            cells={"w": ["count.y", "gain.k"]},
        )
    with pytest.raises(gpac.CallError, match="'k'"):
        scaling().on(memory_rig.fast)(u, y, k=4.0)
    by_psi = scaling("by_psi", lib.block("gain"), input_parameters={"factor": "gain.k"}).on(memory_rig.fast)
    u.value = 2.0
    by_psi(u, y, factor=5.0)
    assert y.value == 10.0, "only where the verb says so, under the verb's own name"
    with pytest.raises(gpac.ValueRefused, match=r"cannot be SVV k"):
        by_psi(u, y, factor=k)


FUNCTION = """#include <opengpac.h>
__attribute__((visibility("default"))) double smoother(double before, double u) { return before + 0.25 * (u - before); }

FUNCTION_BLOCK(smooth, "y follows u.", in(double, u, "value"), out(double, y, "a smoother one"))
{
    self->y = smoother(self->y, self->u);
    return OK;
}
"""


def test_r019_a_subroutine_is_a_c_function(rig: Rig, tmp_path: Path) -> None:
    """A block computes in a running system the same values as its C code does when called directly."""
    source = tmp_path / "smooth.c"
    source.write_text(FUNCTION)
    machine_code = _native.build([str(source)], str(tmp_path / "smooth.so"))
    module = rig.cell.download(machine_code, "smooth")
    assert [block.name for block in module] == ["smooth.smooth"], "a function is a block where it says so"
    with pytest.raises(gpac.UnknownName, match="smoother"):
        module["smoother"]
    y = rig.cell.svv("y", history=20)
    verb = gpac.Verb(
        "smoothing",
        blocks={"count": rig.block("count.count"), "smooth": module.smooth},
        instantiation_parameters={"y": "smooth.y"},
        cells={"u": ["count.y", "smooth.u"]},
        command_lists={"start": [activate("count", every="1 ms"), activate("smooth")]},
    )
    verb.on(rig.fast).asynch(y)
    rig.cell.advance("20 ms")
    called = ctypes.CDLL(machine_code).smoother
    called.restype, called.argtypes = ctypes.c_double, [ctypes.c_double, ctypes.c_double]
    expected = [*accumulate((float(k) for k in range(20)), called, initial=0.0)][1:]
    assert y.history[:]["value"].tolist() == expected


def test_r019_what_is_no_c_is_refused_where_it_stands(memory_rig: Rig, tmp_path: Path) -> None:
    source = tmp_path / "wrong.c"
    source.write_text(FUNCTION.replace("return OK;", "return OKAY;"))
    with pytest.raises(gpac.Error, match=r"'OKAY' undeclared.* at .*wrong\.c:7"):
        memory_rig.cell.download(source)
    assert "wrong" not in memory_rig.cell.names["modules"]


def test_r020_the_interface_is_declared_by_macros(memory_rig: Rig, tmp_path) -> None:
    source = tmp_path / "twice.c"
    source.write_text(
        '#include <opengpac.h>\nFUNCTION_BLOCK(twice, "y = 2 u.", in(double, u, "value", "rad"), out(double, y, "twice", "rad"))\n'
        "{ self->y = 2 * self->u; return OK; }\n"
    )
    block = memory_rig.cell.download(source).twice
    assert (block.inputs["u"].unit, block.inputs["u"].type, block.inputs["u"].mode) == ("rad", "double", "synchronous")


def test_r021_a_subroutine_runs_from_its_first_line_to_its_last_wherever_it_is(rig: Rig) -> None:
    """Alone, and in a system with other blocks between its invocations: the same values."""
    alone = rig.block("count.count").run(20).y.tolist()
    # The first values are checked, on a busy machine long after they were stored.
    a, *others = (rig.cell.svv(name, history=20_000) for name in "abc")
    for svv in others:
        rig.counting().on(rig.slow if svv is others[0] else rig.fast, every={"count": "10 ms"}).asynch(svv)
    rig.counting().on(rig.fast).asynch(a)
    rig.until(lambda: len(a.history) >= 20, "twenty invocations")
    assert a.history[:]["value"].tolist()[:20] == alone == [*range(20)]


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
