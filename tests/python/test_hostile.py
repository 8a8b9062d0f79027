# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501
"""Every public call with hostile arguments: they are accepted or refused with a message of ours, and the process survives."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import opengpac as gpac
from opengpac import activate, deactivate, execute, install, interval, on, wait
from opengpac import library as lib
from rig import Rig

HOSTILE: list[Any] = [
    None, True, 0, -1, 3, 256, 2**31, 2**32, 4_000_000_000, 2**63, 2**64, 10**30, -(2**63), -(10**30), 0.5, -0.25, math.nan, math.inf,
    -math.inf, 1e308, "", " ", "\n", "a\nb", "a\0b", "a.b", "a/b", "x" * 70_000, "ü😀", "\ud800", "1e400 s", "-1 s", "0 s", "5", "5 m", "nan s",
    "foo^^bar", b"bytes", [], [1], [[]], [None], (), (1, 0), (0, 1), (1,), {}, {"a": object()}, {1: 2}, {"a": "b"}, object(), set(), 1j, range(3), int, len,
    np.array([]), np.zeros((2, 2)), np.float64(math.nan), np.int64(-1), np.array(["a"]), gpac.deg, gpac.Error, ...,
]  # fmt: skip

NOT_OURS = re.compile(
    r"at line \d+ column \d+|invalid type|invalid value|unknown variant|missing field|did not match any variant|a bug in OpenGPAC|PyO3|object is not|cannot be converted|\{[a-z_]+\}"
)


class Case(NamedTuple):
    """Call with valid arguments."""

    call: Callable[..., Any]
    sane: dict[str, Any]


def counting(r: Rig, **changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb of a library block, which needs no download."""
    sane: dict[str, Any] = {
        "blocks": {"count": lib.chirp},
        "instantiation_parameters": {"y": "count.y"},
        "input_parameters": {"limit": gpac.input("count.amplitude", default=0)},
        "output_values": {"last": "count.y"},
        "command_lists": {"start": [activate("count", every="1 ms")]},
        "conditions": {"enough": on("count.finished", returns=["last"])},
    }
    return gpac.Verb("v", **{**sane, **changes})


def instance(r: Rig) -> gpac.VerbInstance[Any]:
    return counting(r).on(r.fast).asynch(r.cell.svv("y"))


def joint(r: Rig, **members: Any) -> Any:
    drive = r.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=r.fast)
    return gpac.robots.Joint("j", drive=drive["x"], on=r.fast, **members)


def started(r: Rig, **options: Any) -> None:
    counting(r).on(r.fast).asynch(r.cell.svv("y"), **options)


def opened(r: Rig, driver: gpac.drivers.Driver) -> None:
    r.rtp.physical_device("m", driver, exchange=r.fast)


def graph(r: Rig, **changes: Any) -> Any:
    sane = {"blocks": {"k": lib.gain}, "inputs": {"u": "k.u"}, "outputs": {"y": "k.y"}}
    return gpac.Graph("g", **{**sane, **changes})


CALLS: dict[str, Callable[[Rig], Case]] = {
    "System": lambda r: Case(lambda **k: gpac.System(**{"clock": "virtual", **k}).close(), {"name": "s", "clock": "virtual", "seed": 0, "interconnect": "memory", "progress": None, "restore": None, "adopt": False}),
    "System(message)": lambda r: Case(lambda **k: gpac.System("s", clock="virtual", interconnect={"kind": "message", **k}).close(), {"drop": 0.1, "delay_ns": [1, 10], "seed": 3, "unknown": 0.1}),
    "processor": lambda r: Case(r.cell.processor, {"name": "p", "core": None, "supervisor": False, "process": False, "host": None}),
    "timer": lambda r: Case(r.rtp.timer, {"name": "t", "period": "1 ms", "priority": 50, "virtual_cost": 0}),
    "trigger": lambda r: Case(r.rtp.trigger, {"name": "t", "priority": 50, "virtual_cost": 0}),
    "software": lambda r: Case(r.rtp.software, {"name": "t", "priority": 50, "virtual_cost": 0}),
    "physical_device": lambda r: Case(r.rtp.physical_device, {"name": "d", "driver": gpac.drivers.loopback("x"), "exchange": r.fast}),
    "listen": lambda r: Case(r.cell.listen, {"endpoint": "tcp/127.0.0.1:0", "name": None, "authority": None, "certificate": None, "key": None, "token": None, "clock_limit": None}),
    "place": lambda r: Case(r.cell.place, {"placement": {"v.*": r.fast}}),
    "download": lambda r: Case(r.cell.download, {"path": r.built["count"], "name": "again"}),
    "svv": lambda r: Case(r.cell.svv, {"name": "z", "type": "double", "unit": "", "initial": 0.0, "history": 0, "within": None}),
    "svv of an array": lambda r: Case(r.cell.svv, {"name": "z", "type": "double[3]", "unit": "m", "initial": [0, 0, 0], "history": 10, "within": (0, 1)}),
    "instance": lambda r: Case(r.cell.instance, {"name": "x", "verb": None}),
    "device": lambda r: Case(r.cell.device, {"name": "x", "kind": gpac.LogicalDevice}),
    "read": lambda r: Case(lambda svv: r.cell.read(svv), {"svv": None}),
    "override": lambda r: Case(lambda share: setattr(r.cell, "override", share), {"share": 1.0}),
    "mode": lambda r: Case(lambda mode: setattr(r.cell, "mode", mode), {"mode": "manual"}),
    "advance": lambda r: Case(r.cell.advance, {"duration": "1 ms"}),
    "advance until": lambda r: Case(lambda until, within: r.cell.advance(until=until, within=within), {"until": lambda: True, "within": "1 ms"}),
    "emergency_stop": lambda r: Case(r.cell.emergency_stop, {"reason": "why"}),
    "emergency_stop_input": lambda r: Case(r.cell.emergency_stop_input, {"channel": None, "trips": True}),
    "enabling_switch": lambda r: Case(r.cell.enabling_switch, {"channel": None}),
    "pause": lambda r: Case(lambda device: r.cell.pause(device), {"device": None}),
    "resume": lambda r: Case(lambda device: r.cell.resume(device), {"device": None}),
    "save": lambda r: Case(r.cell.save, {"path": "/nowhere/at/all"}),
    "log": lambda r: Case(r.cell.log, {"since": 0}),
    "alarms.define": lambda r: Case(r.cell.alarms.define, {"code": "E", "text": "t", "remedy": "", "severity": "low"}),
    "alarms.trip": lambda r: Case(r.cell.alarms.trip, {"code": "E", "text": "", "source": "program"}),
    "alarms.clear": lambda r: Case(r.cell.alarms.clear, {"code": "E", "source": None}),
    "alarms.acknowledge": lambda r: Case(r.cell.alarms.acknowledge, {"alarm": None}),
    "alarms[]": lambda r: Case(lambda code: r.cell.alarms[code], {"code": "E"}),
    "svv.value": lambda r: Case(lambda value: setattr(r.cell.svv("z"), "value", value), {"value": 1.0}),
    "svv.history[]": lambda r: Case(lambda which: r.cell.svv("z", history=3).history[which], {"which": 0}),
    "Verb": lambda r: Case(lambda **k: counting(r, **k), {"blocks": {"count": lib.chirp}, "command_lists": {"start": [activate("count", every="1 ms")]}, "objects": None, "instantiation_parameters": {"y": "count.y"}, "cells": None, "input_parameters": None, "output_values": None, "conditions": None, "transitions": None, "modes": None, "requires": None, "initial": None, "ending": None, "ending_limit": None, "suspend": "hold", "if_cut_off": None, "doc": "", "manual": False, "function": None}),
    "Verb(name)": lambda r: Case(lambda name: gpac.Verb(name, blocks={"c": lib.chirp}, command_lists={"s": [execute("c")]}), {"name": "v"}),
    "a command list": lambda r: Case(lambda command: counting(r, command_lists={"start": [command]}), {"command": execute("count")}),
    "a transition": lambda r: Case(lambda to: counting(r, transitions={("start", "completed"): to}), {"to": "start"}),
    "a mode": lambda r: Case(lambda mode: counting(r, modes={"count.y": mode}), {"mode": "asynchronous"}),
    "a constant": lambda r: Case(lambda limit: counting(r, blocks={"count": lib.chirp(amplitude=limit)}), {"limit": 3.0}),
    "on(source)": lambda r: Case(lambda **k: counting(r).on(**k), {"where": r.fast, "every": None}),
    "on(every)": lambda r: Case(lambda every: counting(r).on(r.fast, every={"count": every}).asynch(r.cell.svv("y")), {"every": "1 ms"}),
    "named": lambda r: Case(lambda name: counting(r).on(r.fast).named(name).asynch(r.cell.svv("y")), {"name": "n"}),
    "then": lambda r: Case(lambda **k: counting(r).then(**k), {"condition": None, "following": counting(r), "label": None}),
    "compose": lambda r: Case(gpac.compose, {"name": "c", "whole": counting(r)}),
    "together": lambda r: Case(lambda part: gpac.together(part), {"part": None}),
    "start": lambda r: Case(lambda **k: started(r, **k), {"limit": 3, "time_limit": "1 s", "overruns": None}),
    "bound to": lambda r: Case(lambda y: counting(r).on(r.fast).asynch(y), {"y": None}),
    "wait": lambda r: Case(instance(r).wait, {"timeout": "1 ms"}),
    "set": lambda r: Case(instance(r).set, {"limit": 3, "every": {}}),
    "activate": lambda r: Case(activate, {"block": "a", "every": "1 ms", "budget": None}),
    "activate in a verb": lambda r: Case(lambda **k: counting(r, command_lists={"start": [activate("count", **k)]}).on(r.fast).asynch(r.cell.svv("y")), {"every": "1 ms", "budget": None}),
    "interval": lambda r: Case(lambda **k: activate("a", every=interval(**k)), {"every": "1 ms", "tunable": True}),
    "execute": lambda r: Case(lambda block: counting(r, command_lists={"start": [execute(block)]}), {"block": "count"}),
    "deactivate": lambda r: Case(lambda block: counting(r, command_lists={"start": [deactivate(block)]}), {"block": "count"}),
    "install": lambda r: Case(lambda block: counting(r, command_lists={"start": [install(block)]}), {"block": "count"}),
    "gpac.wait": lambda r: Case(lambda until: counting(r, command_lists={"start": [wait(until)]}), {"until": None}),
    "on": lambda r: Case(lambda **k: counting(r, conditions={"enough": on(**k)}), {"conditions": "count.finished", "returns": None, "raises": None, "during": None, "priority": 0, "alarm": None}),
    "input": lambda r: Case(lambda **k: counting(r, input_parameters={"limit": gpac.input(**k)}), {"targets": "count.amplitude", "default": 0, "tunable": False, "unit": "", "within": None, "counted_from": None, "member": "", "form": None}),
    "input in a call": lambda r: Case(lambda limit, **k: counting(r, input_parameters={"limit": gpac.input("count.amplitude", **k)}).on(r.fast).asynch(r.cell.svv("y"), limit=limit), {"limit": 0, "within": (0, 1)}),
    "required": lambda r: Case(gpac.required, {"raises": gpac.NotHomed, "when": None, "remedy": ""}),
    "each": lambda r: Case(lambda device_type: counting(r, objects={"o": gpac.each(device_type)}), {"device_type": gpac.LogicalDevice}),
    "parameter": lambda r: Case(lambda **k: gpac.parameter(**k), {"default": 1.0}),
    "holding": lambda r: Case(lambda **k: counting(r, suspend=gpac.holding(**k)), {"conditions": "count.finished"}),
    "ratio": lambda r: Case(lambda n: graph(r, modes={"k.u": gpac.ratio(n)}), {"n": 2}),
    "Graph": lambda r: Case(lambda **k: graph(r, **k), {"blocks": {"k": lib.gain}, "inputs": None, "outputs": None, "cells": None, "modes": None, "divide": None}),
    "Graph(divide)": lambda r: Case(lambda n: graph(r, divide={"k": n}), {"n": 2}),
    "a block": lambda r: Case(lambda **k: lib.lowpass(**k), {"alpha": 0.5}),
    "a constant of the library": lambda r: Case(lambda alpha: graph(r, blocks={"k": lib.lowpass(alpha=alpha)}), {"alpha": 0.5}),
    "labelled": lambda r: Case(lambda label: gpac.Graph("g", blocks=[lib.lowpass.labelled(label)]), {"label": "a"}),
    "run": lambda r: Case(lib.lowpass.run, {"steps": 3, "every": "1 ms", "u": 1.0, "alpha": 0.5}),
    "run of any size": lambda r: Case(lib.in_position.run, {"steps": 2}),
    "library.block": lambda r: Case(lib.block, {"name": "lowpass"}),
    "loopback": lambda r: Case(lambda part, **k: opened(r, gpac.drivers.loopback(part, **k)), {"part": "x", "initial": (), "fail_at": None, "nan_at": None, "slew": None}),
    "mujoco": lambda r: Case(lambda **k: opened(r, gpac.drivers.mujoco(**k)), {"path": "/nowhere.xml", "timestep": None, "contacts": 0}),
    "scripted": lambda r: Case(lambda **k: opened(r, gpac.drivers.scripted(**k)), {"channels": [{"name": "a.b", "direction": "read"}], "table": ()}),
    "a scripted channel": lambda r: Case(lambda **k: opened(r, gpac.drivers.scripted([k])), {"name": "a.b", "direction": "read", "type": "double", "unit": "", "safe": 0.0, "slew": None}),
    "a scripted row": lambda r: Case(lambda **k: opened(r, gpac.drivers.scripted([{"name": "a.b", "direction": "read"}], [k])), {"at_ns": 0, "values": {"a.b": 1.0}}),
    "Driver": lambda r: Case(lambda **k: opened(r, gpac.drivers.Driver(**k)), {"kind": "loopback", "options": {"parts": ["x"]}}),
    "Joint": lambda r: Case(lambda **k: joint(r, **k), {"max_speed": 1.0, "max_acceleration": 2.0, "position_min": -1.0, "position_max": 1.0, "kp": 1.0, "every": None, "units": None, "arbitration": None}),
    "joint.kp": lambda r: Case(lambda value: setattr(joint(r), "kp", value), {"value": 1.0}),
    "enable": lambda r: Case(lambda timeout: joint(r).enable(timeout), {"timeout": "1 s"}),
    "Group": lambda r: Case(lambda name: gpac.Group(name, joint(r)), {"name": "g"}),
    "Group[]": lambda r: Case(lambda which: gpac.Group("g", joint(r))[which], {"which": 0}),
    "Group.values": lambda r: Case(lambda member: gpac.Group("g", joint(r)).values(member), {"member": "sensed"}),
    "deg": lambda r: Case(gpac.deg, {"angles": 1.0}),
    "load": lambda r: Case(gpac.load, {"path": "/nowhere.toml"}),
    "save(file)": lambda r: Case(lambda **k: gpac.save(**k), {"path": "/nowhere/at.toml"}),
    "open_recording": lambda r: Case(gpac.open_recording, {"path": "/nowhere.mcap"}),
    "robots.load": lambda r: Case(lambda **k: gpac.robots.load(**k), {"path": "nowhere", "rtp": r.rtp, "name": None, "tool": None, "scene": None, "arbitration": "refuse", "contacts": 0}),
}  # fmt: skip


def sentence(error: BaseException) -> None:
    """Checks that an error is ours and has a readable message."""
    if isinstance(error, TimeoutError | IndexError):
        return
    text = str(error)
    if not isinstance(error, gpac.Error) or not text or NOT_OURS.search(text):
        raise AssertionError(f"{type(error).__name__}: {text[:600]}") from error


def forever(what: str, name: str, value: Any) -> bool:
    """Returns whether a value is valid but takes longer than the test can wait, or is a function of the user's own, which may raise its
    own errors."""
    if callable(value) and name in ("form", "until", "function"):
        return True
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool) and value > 3
    return bool(number) and (what, name) in {
        ("advance", "duration"),
        ("advance until", "within"),
        ("wait", "timeout"),
        ("enable", "timeout"),
        ("start", "time_limit"),
    }


class Bench:
    """System for consecutive calls: a refused call changes nothing, so a new system is created only after an accepted one."""

    def __init__(self, what: str, built: dict[str, str]) -> None:
        self.what, self.built = what, built
        self.case = self.anew()

    def anew(self) -> Case:
        self.cell = gpac.System("cell", clock="virtual")
        self.case = CALLS[self.what](Rig(self.cell, self.built))
        return self.case

    def attempt(self, **hostile: Any) -> None:
        """Makes the call; checks that an error has a message of ours."""
        if any(forever(self.what, name, value) for name, value in hostile.items()):
            return
        try:
            self.case.call(**{**self.case.sane, **hostile})
        except BaseException as error:
            sentence(error)
            if not isinstance(error, gpac.InUse):
                return
        self.cell.close()
        self.anew()


@pytest.mark.parametrize("what", CALLS)
def test_one_hostile_argument(built: dict[str, str], what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    bench, wrong = Bench(what, built), []
    for name in bench.case.sane:
        for value in HOSTILE:
            try:
                bench.attempt(**{name: value})
            except AssertionError as error:
                wrong.append(f"{name}={value!r:.60}: {str(error)[:300]}")
    bench.cell.close()
    assert not wrong, "\n" + "\n".join(wrong)


@settings(
    max_examples=200,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(drawn=st.data())
def test_several_hostile_arguments(built: dict[str, str], tmp_path: Path, drawn: st.DataObject) -> None:
    what = drawn.draw(st.sampled_from([*CALLS]))
    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path)
        bench = Bench(what, built)
        names = st.lists(st.sampled_from([*bench.case.sane]), min_size=1, unique=True)
        bench.attempt(**{name: drawn.draw(st.sampled_from(HOSTILE)) for name in drawn.draw(names)})
        bench.cell.close()


NAMED = ["System", "processor", "timer", "trigger", "software", "physical_device", "svv", "Verb(name)", "named", "Group"]


@pytest.mark.parametrize("name", ["", "  ", "a\nb", "a\0b", "\x1b[31m", "x" * 300], ids=repr)
@pytest.mark.parametrize("what", NAMED)
def test_a_name_can_stand_in_a_line(built: dict[str, str], what: str, name: str) -> None:
    bench = Bench(what, built)
    with pytest.raises(gpac.CallError, match="name"):
        bench.case.call(**{**bench.case.sane, "name": name})
    bench.cell.close()


def test_absurd_sizes_and_ranges_are_refused(memory_rig: Rig) -> None:
    cell = memory_rig.cell
    with pytest.raises(gpac.ValueRefused, match=r"a history of 4000000000 values of SVV 'h' would take 96000 MB; ask for at most"):
        cell.svv("h", history=4_000_000_000)
    with pytest.raises(gpac.ValueRefused, match="lower end first"):
        cell.svv("h", within=(1, 0))
    with pytest.raises(gpac.OutOfRange, match=r"SVV 'h' cannot be 5: its range is 0 to 1"):
        cell.svv("h", within=(0, 1), initial=5)
    with pytest.raises(gpac.OutOfRange, match="0 to 10,000,000"):
        lib.lowpass.run(10**12, u=1.0)
    with pytest.raises(gpac.ValueRefused, match=r"drop=2"):
        gpac.System("m", clock="virtual", interconnect={"kind": "message", "drop": 2})
    with pytest.raises(gpac.ValueRefused, match="the minimum first"):
        gpac.System("m", clock="virtual", interconnect={"kind": "message", "delay_ns": [10, 1]})
    with pytest.raises(gpac.DefinitionError, match=r"there is no 'dropp' here: there are"):
        gpac.System("m", clock="virtual", interconnect={"kind": "message", "dropp": 0.1})
    assert math.isfinite(cell.now)
