# SPDX-License-Identifier: Apache-2.0
"""An axis on EtherCAT as a joint of a cell. Its bounds are so wide that no machine is too slow for the segment, which is a program."""

from __future__ import annotations

import pytest

import opengpac as gpac


def test_an_axis_is_a_joint_and_its_objects_are_read() -> None:
    axis = {"counts": 10_000, "range": [-10, 10], "speed_max": 5.0}
    with gpac.drivers.fake.ethercat("x") as segment, gpac.System("cell", progress=False) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        driver = gpac.drivers.ethercat(segment.interface, {"x": axis}, timeout="6.5 s", lost_after=30_000)
        line = rtp.physical_device("line", driver, exchange=fast)
        joint = gpac.robots.Joint("j", drive=line["x"], on=fast, max_following_error=10.0)
        joint.enable()
        gpac.motion.move_absolute(gpac.Group("arm", joint), goal=[0.5])
        assert joint.sensed.value == pytest.approx(0.5, abs=0.02)
        # 0x1000, the type of a device: a drive by CiA 402.
        assert line.services.read_object(axis="x", index=0x1000)["number"] & 0xFFFF == 402
        assert line.counters["cycles"] > 0
        joint.disable()
