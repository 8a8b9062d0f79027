# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501
"""Motions, signals, recordings and connections with hostile arguments: accepted or refused with a message of ours, and the machine
survives."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import opengpac as gpac
from axes import machine
from cell_rig import CHANNELS
from opengpac import cell as signals
from opengpac import motion
from opengpac.studio import server
from test_hostile import HOSTILE, Case, sentence

HERE: list[Any] = [
    *HOSTILE, [0.1], [0.1, 0.1, 0.1], [math.nan, 0.1], [math.inf, 0.1], [1e308, -1e308], ["0.1 rad", "5 kg"], [[0.1, 0.1], [0.1]], {"x": 0.1},
    {"axes.x": None}, {"axes.x": math.nan}, np.full(2, np.nan), np.zeros((0, 2)), np.zeros((3, 3)), np.zeros(0), "-5 %", "1e300 %", "0 %", "%",
]  # fmt: skip
BRIEFLY = "2 ms"


class Machine:
    """Two enabled axes, signals, and SVVs for motions to follow."""

    def __init__(self, folder: Path) -> None:
        self.cell = gpac.System("cell", clock="virtual", seed=1)
        self.folder, self._files = folder, 0
        self._served: server.Studio | None = None
        self.axes = machine(self.cell)
        processor = self.cell.processor("io")
        self.fast = processor.timer("fast", period="1 ms", priority=80)
        self.io = processor.physical_device("io", gpac.drivers.scripted(CHANNELS), exchange=self.fast)
        self.valve = signals.DigitalOutput("valve", self.io["valve"]).enable()
        self.heater = signals.AnalogOutput("heater", self.io["heater"], low=0.0, high=10.0).enable()
        self.gate = signals.DigitalInput("gate", self.io["gate"]).enable()
        self.pressure = signals.AnalogInput("pressure", self.io["pressure"]).enable()
        self.switch = self.cell.svv("switch", "bool", initial=False)
        self.heartbeat = self.cell.svv("heartbeat", "int64_t", initial=0)
        self.master = self.cell.svv("master", "double", initial=0.0)

    def record(self, **given: Any) -> None:
        """Starts a recording, ends it, and deletes the file."""
        self._files += 1
        sane = {"path": self.folder / f"{self._files}.mcap", "svvs": ["master"]}
        self.cell.record(**{**sane, **given}).stop()

    def connect(self, **given: Any) -> None:
        """Connects to the system that this one serves."""
        self._served = self._served or server.serve(self.cell, 0, "operate", None, self.folder)
        parts = urlsplit(self._served.url)
        sane = {"url": f"http://{parts.hostname}:{parts.port}", "token": parts.fragment.removeprefix("token="), "command": False}
        gpac.connect(**{**sane, **given}).close()

    def close(self) -> None:
        """Ends everything."""
        if self._served is not None:
            self._served.stop()
        self.cell.close()


def moving(verb: gpac.Verb[..., Any], *where: Any) -> Callable[..., Any]:
    """Returns a call that runs a motion for some ms and then stops it."""
    return lambda **given: verb(*where, **{"time_limit": BRIEFLY, **given})


CALLS: dict[str, Callable[[Machine], Case]] = {
    "move_absolute": lambda m: Case(moving(motion.move_absolute, m.axes), {"goal": [0.1, 0.1], "speed": "30 %", "acceleration": "100 %", "tolerance": 0.002, "time_limit": BRIEFLY}),
    "move_absolute of a joint": lambda m: Case(moving(motion.move_absolute, m.axes[0]), {"goal": 0.1, "speed": 0.3}),
    "move_absolute of": lambda m: Case(lambda arm: motion.move_absolute(arm, [0.1, 0.1], time_limit=BRIEFLY), {"arm": m.axes}),
    "move_relative": lambda m: Case(moving(motion.move_relative, m.axes), {"goal": [0.1, 0.1], "speed": "30 %", "acceleration": "100 %", "tolerance": 0.002}),
    "move_velocity": lambda m: Case(moving(motion.move_velocity, m.axes), {"velocity": [0.1, 0.1], "acceleration": "100 %"}),
    "stop": lambda m: Case(moving(motion.stop, m.axes), {"deceleration": "100 %"}),
    "stop of": lambda m: Case(lambda arm: motion.stop(arm, time_limit=BRIEFLY), {"arm": m.axes}),
    "jog": lambda m: Case(moving(motion.jog, m.axes, m.heartbeat), {"velocity": [0.1, 0.1], "acceleration": "50 %"}),
    "jog by": lambda m: Case(lambda heartbeat: motion.jog(m.axes, heartbeat, 0.1, time_limit=BRIEFLY), {"heartbeat": m.heartbeat}),
    "gear": lambda m: Case(moving(motion.gear, m.axes[0], m.master), {"ratio": 1.0, "acceleration": "100 %"}),
    "gear to": lambda m: Case(lambda master: motion.gear(m.axes[0], master, time_limit=BRIEFLY), {"master": m.master}),
    "home": lambda m: Case(moving(motion.home, m.axes[0], m.switch), {"speed": "10 %", "creep": "1 %", "position": 0.0}),
    "home by": lambda m: Case(lambda switch: motion.home(m.axes[0], switch, time_limit=BRIEFLY), {"switch": m.switch}),
    "home_here": lambda m: Case(moving(motion.home_here, m.axes), {"position": 0.0}),
    "follow": lambda m: Case(moving(motion.follow, m.axes), {"points": [[0.1, 0.1], [0.2, 0.0]], "blend": 0.05, "speed": 0.5, "tolerance": 0.002}),
    "follow a point": lambda m: Case(lambda point: motion.follow(m.axes, [[0.1, 0.1], point], time_limit=BRIEFLY), {"point": [0.2, 0.0]}),
    "move_linear": lambda m: Case(moving(motion.move_linear, m.axes), {"pose": gpac.Pose((0.4, 0.0, 0.3)), "speed": 0.25, "angular_speed": 1.0, "acceleration": 1.0, "tolerance": 0.002, "chain": None}),
    "move_circular": lambda m: Case(moving(motion.move_circular, m.axes), {"via": gpac.Pose((0.4, 0.1, 0.3)), "goal": gpac.Pose((0.4, 0.0, 0.3)), "speed": 0.25, "angular_speed": 1.0, "acceleration": 1.0, "angle": 1.0, "orientation": "path", "tolerance": 0.002, "chain": None}),
    "follow_linear": lambda m: Case(moving(motion.follow_linear, m.axes), {"poses": [gpac.Pose((0.4, 0.0, 0.3))], "blend": 0.01, "speed": 0.25, "angular_speed": 1.0, "acceleration": 1.0, "tolerance": 0.002, "chain": None}),
    "carry": lambda m: Case(moving(motion.carry, m.axes), {"mass": 1.0, "centre": (0.0, 0.0, 0.0), "chain": None}),
    "Pose": lambda m: Case(gpac.Pose, {"position": (0.0, 0.0, 0.0), "rpy": (0.0, 0.0, 0.0)}),
    "DigitalInput": lambda m: Case(signals.DigitalInput, {"name": "seen", "channel": m.io["valve_seen"], "on": m.fast}),
    "DigitalOutput": lambda m: Case(lambda **k: signals.DigitalOutput("other", m.io["valve"], **k), {"on": m.fast, "at_enable": False}),
    "AnalogInput": lambda m: Case(signals.AnalogInput, {"name": "seen", "channel": m.io["heater_seen"], "on": m.fast}),
    "AnalogOutput": lambda m: Case(lambda **k: signals.AnalogOutput("other", m.io["heater"], **k), {"on": m.fast, "low": 0.0, "high": 10.0, "at_enable": 1.0}),
    "set_output": lambda m: Case(lambda **k: signals.set_output(m.valve, **k), {"value": True}),
    "set_output of an analog one": lambda m: Case(lambda **k: signals.set_output(m.heater, **k), {"value": 1.0}),
    "set_output of": lambda m: Case(lambda signal: signals.set_output(signal, True), {"signal": m.valve}),
    "pulse": lambda m: Case(lambda **k: signals.pulse(m.valve, **k, time_limit=BRIEFLY), {"width": "1 ms", "value": True}),
    "wait_for_input": lambda m: Case(lambda **k: signals.wait_for_input(m.gate, **{"time_limit": BRIEFLY, **k}), {"value": False, "edge": None, "time_limit": BRIEFLY}),
    "wait_for_input of an analog one": lambda m: Case(lambda **k: signals.wait_for_input(m.pressure, **k, time_limit=BRIEFLY), {"above": -1.0, "below": 1.0}),
    "wait_for_input of": lambda m: Case(lambda signal: signals.wait_for_input(signal, time_limit=BRIEFLY), {"signal": m.gate}),
    "record": lambda m: Case(m.record, {"path": "x.mcap", "svvs": ["master"], "cells": False, "replay": False}),
    "record a name": lambda m: Case(lambda name: m.record(svvs=[name]), {"name": "master"}),
    "connect": lambda m: Case(m.connect, {"name": "hostile", "ca": None, "certificate": None, "command": False, "lost_after": "5 s", "progress": None}),
    "connect to": lambda m: Case(lambda url: gpac.connect(url).close(), {"url": "http://127.0.0.1:1"}),
    "connect by": lambda m: Case(lambda token: m.connect(token=token), {"token": "none"}),
}  # fmt: skip


def is_patient(name: str, value: Any) -> bool:
    """Returns whether a time limit is valid but longer than the test can wait."""
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return name in ("time_limit", "width") and number and bool(value > 3)


def moves_still(machine: Machine) -> bool:
    """Returns whether the machine still obeys a valid command."""
    machine.cell.advance("10 ms")
    try:
        motion.stop(machine.axes)
        motion.move_relative(machine.axes, [0.001, 0.001])
    except gpac.Error:
        return False
    return True


@pytest.mark.parametrize("what", CALLS)
def test_one_hostile_argument(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "index.html").touch()
    there = Machine(tmp_path)
    case, wrong = CALLS[what](there), []
    for name in case.sane:
        for value in HERE:
            if is_patient(name, value):
                continue
            taken = True
            try:
                case.call(**{**case.sane, name: value})
            except BaseException as error:
                taken = not isinstance(error, gpac.CallError | gpac.ValueRefused | gpac.DefinitionError | gpac.UnknownName)
                try:
                    sentence(error)
                except AssertionError as told:
                    wrong.append(f"{name}={value!r:.60}: {str(told)[:300]}")
            if taken and not moves_still(there):
                # An accepted motion may have led to a dead end: out of the range, or lost.
                there.close()
                there = Machine(tmp_path)
                assert moves_still(there)
                case = CALLS[what](there)
    there.close()
    assert not wrong, "\n" + "\n".join(wrong)
