# SPDX-License-Identifier: Apache-2.0
"""Tables of existing objects: printed, in a notebook, and by rich; the plain repr is unchanged."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import pytest
from rich.console import Console

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from opengpac.values.tables import Table


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("cell", clock="virtual") as system:
        yield system


class Axis(gpac.LogicalDevice):
    """Axis without a verb."""

    sensed: gpac.SVV[float] = gpac.svv(unit="rad")
    speed = gpac.parameter(1.5, unit="rad/s", tunable=True)


def wave() -> gpac.Verb[..., Any]:
    return gpac.Verb(
        "wave",
        blocks={"wave": lib.signal_generator(shape=0, offset=2.5)},
        instantiation_parameters={"y": ["wave.y"]},
        output_values={"last": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms")]},
        conditions={"halted": gpac.on(returns=["last"])},
    )


def printed(thing: Any) -> str:
    """Returns the output of rich on a wide page."""
    sheet = io.StringIO()
    Console(file=sheet, width=200).print(thing)
    return sheet.getvalue()


def cells(thing: Any) -> list[list[str]]:
    """Returns the rows of an object's tables in a notebook."""
    html = f"<div>{thing._repr_html_()}</div>"
    return [["".join(cell.itertext()) for cell in row] for row in ElementTree.fromstring(html).iter("tr")]


def test_a_table_lines_up_and_escapes() -> None:
    table = Table("a <b>", ["name", "value"], [["x & y", 1.5], ["[red]", "20 ms"]], ["bad"])
    assert repr(table).splitlines() == ["a <b>", "name   value", "x & y    1.5", "[red]  20 ms"]
    assert cells(table) == [["name", "value"], ["x & y", "1.5"], ["[red]", "20 ms"]]
    assert "a <b>" in printed(table) and "[red]" in printed(table), "rich reads no markup out of names"
    assert "<b>" not in table._repr_html_().replace("<b>a", "")


def test_a_system_shows_what_there_is_and_its_repr_stays(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    y = cell.svv("y", unit="m")
    instance = wave().on(fast).asynch(y)
    cell.advance("10 ms")
    assert ["svvs", "y"] in cells(cell) and ["svvs", "y"] in cells(cell.names)
    row = next(row for row in cells(cell.statistics) if row[0] == "rtp0.fast")
    assert row[1] == "10"
    assert "wave" in printed(cell.verbs) and "wave#" in printed(cell.instances)
    assert cells(cell.instances)[1][1:3] == ["running", "start"]
    assert repr(cell).startswith("system 'cell' (virtual clock")
    assert repr(cell.statistics).startswith("{'"), "it is a dictionary as before"
    assert [row[0] for row in cells(fast.processor)] == ["source", "rtp0.fast"]
    assert cells(instance) == [["block", "what", "source"], ["wave", "library.signal_generator", "rtp0.fast"]]
    assert cells(y)[1][:3] == ["y", "double", "m"]
    assert any("start" in row for row in cells(cell.log()))
    instance.halt()
    report = instance.wait()
    assert ["condition", "halted"] in cells(report) and "2.5" in printed(report)


def test_devices_and_groups_show_their_values(cell: gpac.System) -> None:
    arm = gpac.Group("arm", *(Axis(name, system=cell) for name in ("shoulder", "elbow")))
    assert cells(arm) == [["device", "state", "sensed"], ["shoulder", "disabled", "0"], ["elbow", "disabled", "0"]]
    assert cells(arm.elbow)[1:] == [["sensed", "0.0", "rad", "SVV"], ["speed", "1.5", "rad/s", "tunable parameter"]]
    assert "elbow: disabled" in printed(arm.elbow)


def test_channels_blocks_and_components(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    device = fast.processor.physical_device("loop", gpac.drivers.loopback("elbow"), exchange=fast)
    assert ["elbow.effort", "double", "N.m", "written"] in cells(device)
    assert ["effort", "double", "N.m", "written"] in cells(device["elbow"])
    assert ["input", "u", "double", "", "synchronous"] in [row[:5] for row in cells(lib.lowpass)]
    assert "lowpass" in printed(lib.search("low-pass"))


def test_alarms_show_and_none_are_none(cell: gpac.System) -> None:
    assert printed(cell.alarms).strip() == "no alarms" and cell.alarms._repr_html_() is None
    cell.alarms.define("E101", "less than <two>")
    cell.alarms.trip("E101")
    assert "less than <two>" in cells(cell.alarms)[1]


def test_of_a_closed_system_there_is_no_table(cell: gpac.System) -> None:
    cell.processor("rtp0")
    y = cell.svv("y")
    axis = Axis("axis", system=cell)
    cell.close()
    assert [thing._repr_html_() for thing in (cell, y, axis, cell.alarms)] == [None] * 4
    assert "closed" in printed(cell) and "closed" in printed(y)


def test_block_times_are_taken_while_somebody_looks(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    y = cell.svv("y")
    wave().on(fast).asynch(y)
    cell.advance("5 ms")
    assert cell.block_times(fast, during="1 h").rows == []
    cell.advance("7 ms")
    (row,) = cell.block_times().rows
    assert (row[0].partition("#")[0], row[1], row[2], row[-1]) == ("wave", "library.signal_generator", "rtp0.fast", "7")
    (block,) = cell.statistics["sources"]["rtp0.fast"]["blocks"]
    assert block["number"] == 12 and block["max_ns"] >= block["mean_ns"] >= 0
    assert "wave" in repr(cell.top()) and "rtp0.fast" in repr(cell.top())


def test_what_is_computed_does_not_depend_on_who_looks(cell: gpac.System) -> None:
    values = []
    for name, looks in (("a", False), ("b", True)):
        with gpac.System(name, clock="virtual") as system:
            fast = system.processor("rtp0").timer("fast", period="1 ms", priority=80)
            y = system.svv("y", history=50)
            if looks:
                system.block_times(during="1 h")
            wave().on(fast).asynch(y)
            system.advance("50 ms")
            values.append(y.history[:].tobytes())
    assert values[0] == values[1]


def test_asking_wrongly_is_refused(cell: gpac.System) -> None:
    with pytest.raises(gpac.LimitExceeded, match="at most one hour"):
        cell.block_times(during="2 h")
    with pytest.raises(gpac.CallError, match="pass an interrupt source"):
        cell.block_times("fast")  # type: ignore[arg-type]
