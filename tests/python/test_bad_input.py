# SPDX-License-Identifier: Apache-2.0
"""Every public call with a wrong name, type, unit or state raises its own exception, and changes nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from rig import Rig


@pytest.fixture
def full(memory_rig: Rig) -> Iterator[Rig]:
    """Yields a rig with an SVV `a`, a device `drive` and a running verb."""
    (memory_rig.a, memory_rig.b) = memory_rig.svvs("a", "b")  # type: ignore[attr-defined]
    memory_rig.drive = memory_rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=memory_rig.fast)  # type: ignore[attr-defined]
    memory_rig.running = memory_rig.counting().on(memory_rig.fast).named("running").asynch(memory_rig.a)  # type: ignore[attr-defined]
    memory_rig.cell.advance("1 ms")
    yield memory_rig


WRONG: dict[str, tuple[type[Exception], Callable[[Any], Any]]] = {
    "system without a name": (gpac.CallError, lambda r: gpac.System("")),
    "system with an unknown clock": (gpac.CallError, lambda r: gpac.System("x", clock="atomic")),
    "system that runs": (gpac.InUse, lambda r: gpac.System("cell", clock="virtual", seed=7)),
    "processor twice": (gpac.InUse, lambda r: r.cell.processor("rtp0", core=0)),
    "timer twice": (gpac.InUse, lambda r: r.rtp.timer("fast", period="3 ms")),
    "timer without unit": (gpac.ValueRefused, lambda r: r.rtp.timer("t", period="1")),
    "timer with a length": (gpac.UnitMismatch, lambda r: r.rtp.timer("t", period="1 mm")),
    "timer of no period": (gpac.Error, lambda r: r.rtp.timer("t", period=0)),
    "timer of negative period": (gpac.OutOfRange, lambda r: r.rtp.timer("t", period="-1 ms")),
    "priority out of range": (gpac.OutOfRange, lambda r: r.rtp.timer("t", period="1 ms", priority=1000)),
    "request of a timer": (gpac.Error, lambda r: r.fast.request()),
    "driver that is none": (gpac.CallError, lambda r: r.rtp.physical_device("d", "ur5e.xml", exchange=r.fast)),
    "exchange that is none": (gpac.CallError, lambda r: r.rtp.physical_device("d", gpac.drivers.loopback("x"), exchange="fast")),
    "driver of an unknown kind": (gpac.Error, lambda r: r.rtp.physical_device("d", gpac.drivers.Driver("warp"), exchange=r.fast)),
    "device twice": (gpac.InUse, lambda r: r.rtp.physical_device("drive", gpac.drivers.loopback("y"), exchange=r.fast)),
    "model that is not there": (gpac.Error, lambda r: r.rtp.physical_device("m", gpac.drivers.mujoco("/nowhere.xml"), exchange=r.fast)),
    "part that is not there": (gpac.UnknownName, lambda r: r.drive["y"]),
    "channel that is not there": (gpac.UnknownName, lambda r: r.drive["x"].torque),
    "place that is none": (gpac.CallError, lambda r: r.cell.place({"move.*": "fast"})),
    "svv twice": (gpac.InUse, lambda r: r.cell.svv("a", "int32_t[3]")),
    "svv of an unknown type": (gpac.Error, lambda r: r.cell.svv("c", "quaternion")),
    "svv of no type": (gpac.DefinitionError, lambda r: r.cell.svv("c", 3.5)),
    "svv with a wrong initial value": (gpac.Error, lambda r: r.cell.svv("c", "double", initial=[1, 2])),
    "write of a wrong type": (gpac.ValueRefused, lambda r: setattr(r.b, "value", [1.0, 2.0])),
    "write of NaN": (gpac.ValueRefused, lambda r: setattr(r.b, "value", float("nan"))),
    "write of an object": (gpac.ValueRefused, lambda r: setattr(r.b, "value", object())),
    "write of a claimed svv": (gpac.Error, lambda r: setattr(r.a, "value", 1.0)),
    "delete of a bound svv": (gpac.InvalidState, lambda r: r.a.delete()),
    "history that is not kept": (gpac.ValueRefused, lambda r: r.a.history[:]),
    "read of no svv": (gpac.CallError, lambda r: r.cell.read("a")),
    "advance by nothing": (gpac.CallError, lambda r: r.cell.advance()),
    "advance by a length": (gpac.UnitMismatch, lambda r: r.cell.advance("2 m")),
    "advance backwards": (gpac.OutOfRange, lambda r: r.cell.advance("-1 s")),
    "advance until never": (TimeoutError, lambda r: r.cell.advance(until=r.b > 1, within="10 ms")),
    "download of nothing": (gpac.ModuleError, lambda r: r.cell.download("/nowhere.c")),
    "download of no module": (gpac.ModuleError, lambda r: r.cell.download(__file__)),
    "block that is not there": (gpac.UnknownName, lambda r: lib.pdi),
    "block with a wrong constant": (gpac.CallError, lambda r: lib.block("lowpass")(alhpa=1)),
    "trial with a wrong input": (gpac.CallError, lambda r: lib.block("lowpass").run(v=[1.0])),
    "trial with a wrong value": (gpac.Error, lambda r: lib.block("lowpass").run(u=["one metre"])),
    "activate without unit": (gpac.ValueRefused, lambda r: activate("x", every="20")),
    "raises that is no termination": (gpac.DefinitionError, lambda r: on("a.b", raises=ValueError)),
    "verb with an unknown block": (gpac.UnknownName, lambda r: r.counting("w", command_lists={"start": [activate("cuont", every="1 ms")]})),
    "verb with an unknown port": (gpac.UnknownName, lambda r: r.counting("w", instantiation_parameters={"y": "count.z"})),
    "verb with an unknown condition": (gpac.UnknownName, lambda r: r.counting("w", conditions={"e": on("count.enuogh")})),
    "verb with an unknown output": (gpac.UnknownName, lambda r: r.counting("w", conditions={"e": on("count.enough", returns=["lst"])})),
    "verb with a block that is none": (gpac.DefinitionError, lambda r: r.counting("w", blocks={"count": "count.count"})),
    "verb with a mode that is none": (gpac.DefinitionError, lambda r: r.counting("w", modes={"count.y": "often"})),
    "call without an argument": (gpac.CallError, lambda r: r.counting("v").on(r.fast)()),
    "call with a wrong name": (gpac.CallError, lambda r: r.counting("v").on(r.fast)(r.b, limti=3)),
    "call with too many": (gpac.CallError, lambda r: r.counting("v").on(r.fast)(r.b, 1, 2, 3)),
    "call with a value for an svv": (gpac.CallError, lambda r: r.counting("v").on(r.fast)(3.0)),
    "call with a wrong value": (gpac.Error, lambda r: r.counting("v").on(r.fast)(r.b, limit="three")),
    "call with a wrong unit": (gpac.Error, lambda r: r.counting("v").on(r.fast)(r.b, limit=[1, 2])),
    "call in no system": (gpac.CallError, lambda r: gpac.robots.move([], [])),
    "call of a second writer": (gpac.SecondWriter, lambda r: r.counting("v").on(r.fast)(r.a)),
    "placed on nothing": (gpac.CallError, lambda r: r.counting("v").on("fast")),
    "placed on a wrong label": (gpac.Error, lambda r: r.counting("v").on({"cuont": r.fast}, every={"cuont": "1 ms"})(r.b)),
    "start of what runs": (gpac.InvalidState, lambda r: r.running.start()),
    "resume of what runs": (gpac.InvalidState, lambda r: r.running.resume()),
    "delete of what runs": (gpac.InvalidState, lambda r: r.running.delete()),
    "set of a parameter that is not tunable": (gpac.Error, lambda r: r.running.set(limit=3)),
    "set of no parameter": (gpac.Error, lambda r: r.running.set(lmiit=3)),
    "wait that is too short": (TimeoutError, lambda r: r.running.wait(timeout="10 ms")),
    "wait before the start": (gpac.InvalidState, lambda r: r.counting("v").on(r.fast).new_instance(r.b).wait()),
    "group of nothing": (gpac.CallError, lambda r: gpac.Group("g")),
    "group of numbers": (gpac.CallError, lambda r: gpac.Group("g", 1, 2)),
    "joint with a wrong member": (gpac.CallError, lambda r: gpac.robots.Joint("j", drive=r.drive["x"], on=r.fast, max_sped=1)),
    "joint in no system": (gpac.CallError, lambda r: gpac.robots.Joint("j")),
    "arm that is not there": (gpac.UnknownName, lambda r: gpac.robots.load("ur6e", r.rtp)),
    "emergency stop input that is none": (gpac.CallError, lambda r: r.cell.emergency_stop_input("button")),
}


@pytest.mark.parametrize("what", WRONG)
def test_it_raises_its_own_exception_and_changes_nothing(full: Any, what: str) -> None:
    kind, call = WRONG[what]
    with pytest.raises(kind) as caught:
        call(full)
    error = caught.value
    if isinstance(error, gpac.Error) and not isinstance(error, gpac.InstallationErrors | gpac.ModuleError):
        assert Path(error.file or "").name in ("test_bad_input.py", "rig.py"), f"the place in the user's program: {error}"
    before = full.a.value
    full.cell.advance("5 ms")
    assert full.running.state == "running" and full.a.value == before + 5


def test_a_closed_system_says_so(memory_rig: Rig) -> None:
    cell = memory_rig.cell
    cell.close()
    cell.close()
    for call in (lambda: cell.now, lambda: cell.advance("1 s"), lambda: cell.svv("x"), lambda: memory_rig.rtp.timer("t", period="1 ms")):
        with pytest.raises(gpac.InvalidState, match="closed"):
            call()
    assert "closed" in repr(cell)


def test_an_emergency_stop_latches(full: Any) -> None:
    full.cell.emergency_stop("a test")
    with pytest.raises(gpac.Terminated) as caught:
        full.running.wait()
    assert caught.value.condition == "emergency_stop"
    with pytest.raises(gpac.EmergencyStopped, match="a test"):
        full.counting("v").on(full.fast)(full.b)
    full.cell.reset()
    assert full.counting("v").on(full.fast)(full.b, limit=2).last == 2


ODD_GOALS: dict[str, tuple[Any, str]] = {
    "a column": (np.zeros((2, 1)), "it takes a number, not a list of 1; give a number, or a string with a unit"),
    "a truth value": ([True, 0.0], "it takes a number, not true"),
    "a table": ([{"rad": 1.0}, 0.0], "it takes a number, not a record"),
    "a masked array": (
        np.ma.array([0.1, 0.2], mask=[True, False]),
        "'goal' is an array whose element 0 (from 0) is masked, which has no value; give every element a value: .filled(…)",
    ),
    "a number beyond all": (["1e400 deg", 0.0], "the number in '1e400 deg' is beyond the range of a double"),
}


@pytest.mark.parametrize("what", ODD_GOALS)
def test_a_goal_that_is_no_number_is_refused_in_words(what: str) -> None:
    goal, said = ODD_GOALS[what]
    arm = gpac.robots.load("two_joint", clock="virtual").enable()
    with pytest.raises(gpac.Error) as caught:
        gpac.motion.move_absolute(arm, goal)
    assert said in str(caught.value)
    for word in ("List(", "Bool(", "Number(", "Record(", "none of the accepted forms"):
        assert word not in str(caught.value)


def test_an_array_without_masked_elements_is_a_goal() -> None:
    arm = gpac.robots.load("two_joint", clock="virtual").enable()
    assert gpac.motion.move_absolute(arm, np.ma.array([0.1, 0.2])).condition == "arrived"
