# SPDX-License-Identifier: Apache-2.0
"""A simulated arm whose time step differs from its servo's period, and one whose joint bears joints that follow it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac

FLYWHEEL = """<mujoco><compiler angle="radian"/><option timestep="{step}"/><worldbody><body><joint name="j" axis="0 0 1" range="-9 9"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
<actuator><motor joint="j" ctrlrange="-100 100"/></actuator></mujoco>"""
FINGER = """<body pos="0 {at} 0"><joint name="{name}" type="slide" axis="0 0 1" range="-1 1"/>
<inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/></body>"""
FINGERS = """<mujoco><option timestep="0.001"/><worldbody>{bodies}</worldbody>
<equality><joint joint1="second" joint2="first" polycoef="0 2 0 0 0"/>
<joint joint1="third" joint2="second" polycoef="0 -1 0 0 0"/></equality>
<actuator><motor joint="first" ctrlrange="-1000 1000"/></actuator></mujoco>"""


@pytest.mark.parametrize("step_ms", [0.3, 1.0, 2.0, 2.5, 7.0])
def test_a_joint_is_read_where_it_is_at_the_release(tmp_path: Path, step_ms: float) -> None:
    (tmp_path / "flywheel.xml").write_text(FLYWHEEL.format(step=step_ms * 1e-3))
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        rtp.timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load(tmp_path / "flywheel.xml", rtp, on=rtp.timer("fast", period="1 ms", priority=80)).enable()
        start = cell.now
        gpac.motion.move_absolute(arm, [3.0], speed=1.0)
        sensed = arm[0].sensed.history[:]
        positions = sensed["value"][sensed["time"] > start]
        # At 1 rad/s a position that is 1 ms old lags by 1e-3 rad; 5 rad/s^2 are 5e-6 rad in one period and 5e-5 rad in 7 ms.
        assert np.abs(np.diff(positions, 2)).max() < 1e-4, "it moves from reading to reading as it moves"
        assert abs(positions[-1] - 3.0) < 1e-3


def test_a_motor_bears_what_follows_its_joint(tmp_path: Path) -> None:
    """The third finger follows the second, and that follows the first. Their bodies are separate trees."""
    bodies = "".join(FINGER.format(at=mass, name=name, mass=mass) for name, mass in (("first", 1), ("second", 3), ("third", 2)))
    (tmp_path / "fingers.xml").write_text(FINGERS.format(bodies=bodies))
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        rtp.timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load(tmp_path / "fingers.xml", rtp, on=rtp.timer("fast", period="1 ms", priority=80)).enable()
        assert [joint.short_name for joint in arm] == ["first"]
        gains = cell.physical_devices["fingers"]["first"].about["decoupled"]
        assert abs(gains["kd"] ** 2 / (4.0 * gains["kp"]) - (1 + 2**2 * 3 + 2**2 * 2)) < 1e-9, "its gains are for the mass of all"
        cell.advance("50 ms")
        # If left to the constraint, the weight of the others would press it down before its integral part has built up.
        assert abs(arm[0].sensed.value) < 1e-5
        gpac.motion.move_absolute(arm, [0.2])
        assert abs(arm[0].sensed.value - 0.2) < 1e-4
