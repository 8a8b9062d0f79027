# SPDX-License-Identifier: Apache-2.0
"""A reading of a device that was never enabled is refused with a message; one that was read before has its age."""

from __future__ import annotations

import pytest

import opengpac as gpac
from opengpac.cell import AnalogInput, DigitalInput


def test_nothing_is_read_of_an_arm_that_was_never_enabled() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system as cell:
        cell.advance("50 ms")
        words = "cannot read 'ur5e.shoulder_pan.sensed': 'ur5e.shoulder_pan' was never enabled, so its value is unknown; enable it first"
        with pytest.raises(gpac.NotEnabled, match=words):
            arm.values("sensed")
        for ask in (lambda: arm["elbow"].sensed.value, lambda: arm["elbow"].velocity.value, lambda: cell.read(arm["elbow"].sensed)):
            with pytest.raises(gpac.NotEnabled, match="was never enabled"):
                ask()
        assert arm.values("max_speed") and arm.values("override") == [1.0] * 6
        assert "sensed" in repr(arm["elbow"]) and str(arm["elbow"].sensed), "what is shown is shown"
        arm.enable()
        home = arm.values("sensed")
        arm.disable()
        before = cell.now
        cell.advance("1 s")
        assert arm.values("sensed") == pytest.approx(home, abs=1e-3)
        assert arm["elbow"].sensed.time <= before, "it is as old as its time says"


def test_nothing_is_read_of_an_input_that_was_never_enabled() -> None:
    with gpac.System("inputs", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        io = fast.processor.physical_device("io", gpac.drivers.scripted(
            [{"name": "part", "direction": "read", "type": "bool"},
             {"name": "pressure", "direction": "read", "type": "double", "unit": "bar"}],
            [{"at_ns": 0, "values": {"part": True, "pressure": 5.9}}]), exchange=fast)  # fmt: skip
        part, pressure = DigitalInput("part", io["part"]), AnalogInput("pressure", io["pressure"])
        cell.advance("10 ms")
        for device in (part, pressure):
            with pytest.raises(gpac.NotEnabled, match=f"'{device.name}' was never enabled"):
                _ = device.value.value
            device.enable()
        cell.advance("10 ms")
        assert (part.value.value, pressure.value.value) == (True, 5.9)
