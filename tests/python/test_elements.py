# SPDX-License-Identifier: Apache-2.0
"""Elements of array ports, `sum.u[1]`: outputs of several blocks reach one array port, and an array output reaches several blocks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("elements", clock="virtual") as cell:
        yield cell


@pytest.fixture
def fast(cell: gpac.System) -> gpac.Source:
    return cell.processor("rtp0").timer("fast", period="1 ms")


def constant(value: float) -> gpac.BlockUse:
    """Returns a block with a constant output."""
    return lib.signal_generator(shape=0, offset=value)


LISTS = {"start": [activate("a", every="1 ms"), activate("b", every="1 ms"), activate("sum")]}


def added(**more: Any) -> dict[str, Any]:
    """Returns the parts of a verb that adds 1.5 and 0.25."""
    blocks = {"a": constant(1.5), "b": constant(0.25), "sum": lib.sum, **more.pop("blocks", {})}
    return {"blocks": blocks, "instantiation_parameters": {"y": "sum.y"}, "command_lists": LISTS} | more


def value_of(cell: gpac.System, fast: gpac.Source, verb: gpac.Verb[..., Any], type: str = "double") -> Any:
    """Returns the verb's `y` after 3 ms."""
    y = cell.svv("y", type)
    instance = verb.on(fast).asynch(y)
    cell.advance("3 ms")
    found = y.value
    instance.halt()
    return found


def test_cells_bind_outputs_to_the_elements_of_a_port(cell: gpac.System, fast: gpac.Source) -> None:
    verb = gpac.Verb("add", cells={"u0": ["a.y", "sum.u[0]"], "u1": ["b.y", "sum.u[1]"]}, **added())
    assert value_of(cell, fast, verb) == 1.75


def test_an_element_may_be_an_svv_or_an_input_parameter(cell: gpac.System, fast: gpac.Source) -> None:
    verb = gpac.Verb(
        "add",
        blocks={"sum": lib.sum},
        instantiation_parameters={"x": "sum.u[0]", "y": "sum.y"},
        input_parameters={"given": "sum.u[1]"},
        modes={"sum.u": "asynchronous"},
        command_lists={"start": [activate("sum", every="1 ms")]},
    )
    x, y = cell.svv("x", initial=2.0), cell.svv("y")
    instance = verb.on(fast).asynch(x, y, given=0.5)
    cell.advance("2 ms")
    x.value = 3.0
    cell.advance("2 ms")
    assert y.value == 3.5
    instance.halt()


def test_labelled_blocks_have_elements_too(cell: gpac.System, fast: gpac.Source) -> None:
    a, b, total = constant(1.5).labelled("a"), constant(0.25).labelled("b"), lib.sum.labelled("sum")
    verb = gpac.Verb(
        "add",
        blocks=[a, b, total],
        cells={"u0": [a.y, total.u[0]], "u1": [b.y, total.u[1]]},
        instantiation_parameters={"y": total.y},
        command_lists=LISTS,
    )
    assert value_of(cell, fast, verb) == 1.75


def test_inputs_of_a_graph_lead_to_elements(cell: gpac.System, fast: gpac.Source) -> None:
    adder = gpac.Graph(
        "adder", blocks={"sum": lib.sum}, inputs={"first": "sum.u[0]", "second": "sum.u[1]"}, outputs={"y": "sum.y"}, doc="Adds two."
    )
    assert (adder.inputs["first"].type, adder.inputs["first"].kind) == ("double", "input")
    verb = gpac.Verb("add", cells={"u0": ["a.y", "sum.first"], "u1": ["b.y", "sum.second"]}, **added(blocks={"sum": adder}))
    assert value_of(cell, fast, verb) == 1.75


def test_elements_of_an_array_port_of_a_graph(cell: gpac.System, fast: gpac.Source) -> None:
    adder = gpac.Graph("adder", blocks={"sum": lib.sum}, inputs={"u": "sum.u"}, outputs={"y": "sum.y"}, doc="Adds several.")
    verb = gpac.Verb("add", cells={"u0": ["a.y", "sum.u[0]"], "u1": ["b.y", "sum.u[1]"]}, **added(blocks={"sum": adder}))
    assert value_of(cell, fast, verb) == 1.75


def test_outputs_within_a_graph_and_of_the_graph_reach_elements(cell: gpac.System, fast: gpac.Source) -> None:
    """Two blocks of a graph lead to one of its array ports; the graph's output and an SVV lead to one of another block."""
    graph = gpac.Graph(
        "added",
        blocks={"a": constant(1.5), "b": constant(0.25), "sum": lib.sum},
        cells={"u0": ["a.y", "sum.u[0]"], "u1": ["b.y", "sum.u[1]"]},
        outputs={"y": "sum.y"},
    )
    verb = gpac.Verb(
        "greater",
        blocks={"added": graph, "greater": lib.maximum},
        instantiation_parameters={"x": "greater.u[1]", "y": "greater.y"},
        cells={"of_graph": ["added.y", "greater.u[0]"]},
        modes={"greater.u": "asynchronous"},
        command_lists={"start": [activate("added", every="1 ms"), activate("greater", every="1 ms")]},
    )
    x, y = cell.svv("x", initial=1.0), cell.svv("y")
    instance = verb.on(fast).asynch(x, y)
    cell.advance("3 ms")
    assert y.value == 1.75
    x.value = 9.0
    cell.advance("3 ms")
    assert y.value == 9.0
    instance.halt()


def test_a_file_of_definitions_has_elements(cell: gpac.System, fast: gpac.Source, tmp_path: Path) -> None:
    (tmp_path / "adding.toml").write_text(
        """
format = "opengpac-definitions"
version = 1
[verbs.add]
doc = "Adds two constants."
blocks.a = { block = "library.signal_generator", constants = { shape = 0, offset = 1.5 } }
blocks.b = { block = "library.signal_generator", constants = { shape = 0, offset = 0.25 } }
blocks.sum = "library.sum"
cells = { u0 = ["a.y", "sum.u[0]"], u1 = ["b.y", "sum.u[1]"] }
instantiation_parameters.y = "sum.y"
command_lists.start = [{ activate = "a", every = "1 ms" }, { activate = "b", every = "1 ms" }, { activate = "sum" }]
"""
    )
    assert value_of(cell, fast, gpac.load(tmp_path / "adding.toml").add) == 1.75


def test_elements_keep_their_unit(cell: gpac.System, fast: gpac.Source) -> None:
    y, angle, mass = cell.svv("y", unit="rad"), cell.svv("angle", unit="rad", initial=0.5), cell.svv("mass", unit="kg")
    verb = gpac.Verb(
        "add",
        blocks={"sum": lib.sum},
        instantiation_parameters={"a": "sum.u[0]", "b": "sum.u[1]", "y": "sum.y"},
        modes={"sum.u": "asynchronous"},
        command_lists={"start": [activate("sum", every="1 ms")]},
    )
    instance = verb.on(fast).asynch(angle, angle, y)
    cell.advance("2 ms")
    assert y.value == 1.0
    instance.halt()
    with pytest.raises(gpac.UnitMismatch, match=r"SVV .y. .double, rad. to output .sum.y. .double, kg.: units differ"):
        verb.on(fast).asynch(mass, mass, y)


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a gap": (
        {"u0": ["a.y", "sum.u[0]"], "u1": ["b.y", "sum.u[2]"]},
        r"element \[1\] of input 'sum.u' .* is not bound, but \[0\], \[2\]",
    ),
    "one twice": ({"u0": ["a.y", "sum.u[0]"], "u1": ["b.y", "sum.u[0]"]}, r"input 'sum.u\[0\]' .* is covered by 'u0' and by 'u1'"),
    "too many": ({"u0": ["a.y", "sum.u[0]"], "u1": ["b.y", "sum.u[16]"]}, r"input 'sum.u' .* has no element \[16\]; it has at most 16"),
    "of a number": (
        {"u0": ["a.y", "sum.u[0]"], "u1": ["b.y[0]", "sum.u[1]"]},
        r"output 'b.y' .* has no elements; write it without brackets",
    ),
    "no index": ({"u0": ["a.y", "sum.u[-1]"]}, r"'sum' \(library.sum\) has no 'u\[-1\]'"),
    "whole, twice": (
        {"u0": ["a.y", "sum.u"], "u1": ["b.y", "sum.u"]},
        r"a port has one binding; name its elements: 'sum.u\[0\]', 'sum.u\[1\]'",
    ),
    "a list in a list": ({"u": [["a.y", "b.y"], "sum.u"]}, r"an item of a list of names must be a string, not .*; .* 'label.port\[0\]'"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_wrong_names_the_element(cell: gpac.System, fast: gpac.Source, wrong: str) -> None:
    cells, message = WRONG[wrong]
    with pytest.raises(gpac.Error, match=message):
        value_of(cell, fast, gpac.Verb("add", cells=cells, **added()))


def test_a_port_is_not_bound_whole_and_by_elements(cell: gpac.System, fast: gpac.Source) -> None:
    parts = added(instantiation_parameters={"y": "sum.y", "u": "sum.u"})
    with pytest.raises(gpac.CoverError, match=r"input 'sum.u' .* is covered as a whole by 'u', and its element \[0\] by another"):
        gpac.Verb("add", cells={"u0": ["a.y", "sum.u[0]"]}, **parts)


def test_an_array_output_is_scattered_to_elements(cell: gpac.System, fast: gpac.Source) -> None:
    verb = gpac.Verb(
        "turned",
        blocks={"set": lib.set_position, "swap": lib.gain(k=2.0)},
        instantiation_parameters={"y": "swap.y"},
        cells={"first": "set.new_offset[0]", "second": ["set.new_offset[1]", "swap.u"]},
        input_parameters={"position": "set.position", "captured": "set.captured", "offset": "set.offset", "commanded": "set.commanded"},
        command_lists={"start": [activate("set", every="1 ms"), activate("swap")]},
    )
    y = cell.svv("y")
    zeros = [0.0, 0.0]
    instance = verb.on(fast).asynch(y, position=[0.25, 0.75], captured=zeros, offset=zeros, commanded=zeros)
    cell.advance("2 ms")
    assert y.value == 1.5
    instance.halt()
