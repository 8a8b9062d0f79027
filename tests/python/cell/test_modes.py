# SPDX-License-Identifier: Apache-2.0
"""Manual and automatic mode, and the enabling switch."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.cell import set_output, wait_for_input
from opengpac.robots import Joint, move


@pytest.fixture
def nudge() -> gpac.Verb[..., Any]:
    """Returns a verb that moves a joint by hand, slowly, until it is halted."""
    return gpac.Verb(
        "nudge",
        blocks={"sweep": gpac.library.set_analog},
        objects={"joint": Joint},
        instantiation_parameters={"joint.commanded": "sweep.y"},
        input_parameters={"to": "sweep.value"},
        command_lists={"start": [gpac.activate("sweep", every="20 ms")]},
        manual=True,
    )


def test_manual_mode_starts_only_what_is_declared_for_it(cell: gpac.System, nudge: gpac.Verb[..., Any]) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    assert cell.mode == "automatic"
    cell.mode = "manual"
    with pytest.raises(gpac.InvalidState, match="manual mode, but verb 'robot_move' is not declared for it"):
        move(bench.arm, goal=[0.1, 0.1])
    nudging = nudge.asynch(bench.arm.x, to=0.05)
    cell.advance("200 ms")
    assert bench.arm.x.sensed.value == pytest.approx(0.05, abs=1e-3)
    nudging.halt()
    valve = bench.output()
    assert set_output(valve, True).condition == "written"
    with pytest.raises(gpac.Terminated):
        wait_for_input(bench.io["gate"], time_limit="5 ms")
    cell.mode = "automatic"
    assert move(bench.arm, goal=[0.1, 0.1]).condition == "arrived"


def test_the_mode_changes_at_rest_only(cell: gpac.System, nudge: gpac.Verb[..., Any]) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    moving = move.asynch(bench.arm, goal=[0.1, 0.1])
    with pytest.raises(gpac.InvalidState, match=f"'{moving.name}' is running"):
        cell.mode = "manual"
    cell.pause()
    with pytest.raises(gpac.InvalidState, match=f"'{moving.name}' is suspended"):
        cell.mode = "manual"
    cell.resume()
    moving.wait()
    cell.mode = "manual"
    cell.mode = "manual"
    nudging = nudge.asynch(bench.arm.x, to=0.0)
    with pytest.raises(gpac.InvalidState, match=nudging.name):
        cell.mode = "automatic"
    assert cell.mode == "manual"


def test_the_enabling_switch_is_held_while_something_moves(cell: gpac.System, nudge: gpac.Verb[..., Any]) -> None:
    bench = Bench(cell, [(50, {"enabling": True}), (150, {"enabling": False})])
    bench.arm.enable()
    cell.enabling_switch(bench.io["enabling"])
    cell.mode = "manual"
    with pytest.raises(gpac.InvalidState, match=r"enabling switch 'io\.enabling' is not held"):
        nudge.asynch(bench.arm.x, to=0.05)
    cell.advance("60 ms")
    with pytest.raises(gpac.Terminated, match=r"enabling switch 'io\.enabling' was released") as caught:
        nudge(bench.arm.x, to=0.05)
    assert caught.value.condition == "aborted"
    assert caught.value.report.ended == pytest.approx(0.150)
    assert bench.arm.x.state == "standstill", "the servo holds"
    cell.mode = "automatic"
    assert move(bench.arm, goal=[0.1, 0.1]).condition == "arrived", "in automatic mode nobody need hold it"


def test_a_switch_that_is_held_already_reads_so_at_once(cell: gpac.System, nudge: gpac.Verb[..., Any]) -> None:
    bench = Bench(cell, [(0, {"enabling": True})])
    bench.arm.enable()
    cell.advance("5 ms")
    cell.mode = "manual"
    now = cell.now
    cell.enabling_switch(bench.io["enabling"])
    nudging = nudge.asynch(bench.arm.x, to=0.05)
    assert cell.now == now
    cell.advance("20 ms")
    assert nudging.state == "running"


def test_a_composition_is_manual_where_all_its_parts_are(cell: gpac.System, nudge: gpac.Verb[..., Any]) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    automatic = gpac.Verb(
        "automatic", blocks={"sweep": gpac.library.set_analog}, objects={"joint": Joint},
        instantiation_parameters={"joint.commanded": "sweep.y"}, command_lists={"start": [gpac.execute("sweep")]},
    )  # fmt: skip
    assert nudge.then("halted", nudge).manual
    mixed = nudge.then("halted", automatic)
    assert not mixed.manual
    cell.mode = "manual"
    with pytest.raises(gpac.InvalidState, match="not declared for it"):
        mixed.asynch(bench.arm.x, to=0.05)


def test_a_device_may_be_enabled_in_manual_mode(cell: gpac.System) -> None:
    bench = Bench(cell)
    cell.mode = "manual"
    bench.arm.enable()
    assert [joint.state for joint in bench.arm] == ["standstill", "standstill"]


def test_wrong_modes_and_switches_are_refused(cell: gpac.System) -> None:
    bench = Bench(cell)
    with pytest.raises(gpac.CallError, match="automatic"):
        cell.mode = "auto"
    with pytest.raises(gpac.CallError):
        cell.enabling_switch("io.enabling")  # type: ignore[arg-type]
    with pytest.raises(gpac.UnknownName):
        cell.enabling_switch(bench.io["valve"])
    cell.emergency_stop_input(bench.io["stop"])
    with pytest.raises(gpac.InUse):
        cell.enabling_switch(bench.io["stop"])
    cell.enabling_switch(bench.io["enabling"])
    with pytest.raises(gpac.InvalidState, match="enabling switch"):
        bench.io.delete()


def test_homing_is_for_manual_mode(cell: gpac.System) -> None:
    arm = Bench(cell).arm.enable()
    cell.mode = "manual"
    assert gpac.motion.home_here(arm, 0.5).condition == "completed"
    cell.advance("5 ms")
    assert arm.values("sensed") == pytest.approx([0.5, 0.5], abs=1e-3)
    homing = gpac.motion.home.asynch(arm[0], cell.svv("at_the_switch", bool))
    cell.advance("0.1 s")
    assert homing.state == "running"
    homing.halt()
