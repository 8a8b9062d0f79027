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


def test_what_a_motion_raises_says_what_the_drive_found_wrong() -> None:
    drive = {"name": "x", "watchdog": False}
    with gpac.drivers.fake.ethercat(drive) as segment, gpac.System("cell", clock="virtual", progress=False) as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        driver = gpac.drivers.ethercat(segment.interface, {"x": {"counts": 10_000, "range": [-10, 10], "speed_max": 5.0}})
        line = fast.processor.physical_device("line", driver, exchange=fast)
        joint = gpac.robots.Joint("j", drive=line["x"], on=fast, max_following_error=10.0).enable()
        moving = gpac.motion.move_absolute.asynch(gpac.Group("arm", joint), goal=[5.0])
        cell.advance("50 ms")
        segment.fail(0, 0x2310)
        with pytest.raises(gpac.Terminated, match=r"axis 'x' has a fault, 0x2310: continuous over-current") as ended:
            moving.wait()
        assert ended.value.condition == "device_lost"


def test_drives_that_were_swapped_are_not_enabled() -> None:
    gripper, spindle = {"name": "a", "serial": 11, "watchdog": False}, {"name": "b", "serial": 12, "watchdog": False}
    with gpac.drivers.fake.ethercat(gripper, spindle) as segment, gpac.System("cell", clock="virtual", progress=False) as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        axis = {"counts": 10_000, "range": [-10, 10], "speed_max": 5.0}
        driver = gpac.drivers.ethercat(segment.interface, {"gripper": axis, "spindle": axis})
        line = fast.processor.physical_device("line", driver, exchange=fast)
        joint = gpac.robots.Joint("j", drive=line["gripper"], on=fast, max_following_error=10.0).enable()
        segment.swap(0, 1)
        cell.advance("50 ms")
        with pytest.raises(gpac.Error, match=r"axis 'gripper' at place 0 is another .* axis 'spindle' at place 1: the two are swapped"):
            line.reopen()
        with pytest.raises(gpac.DeviceFailed, match="physical device 'line' is lost"):
            joint.enable()
        assert [drive.drive for drive in segment.drives()] == ["switch on disabled", "switch on disabled"]
        segment.swap(0, 1)
        cell.reset()
        joint.enable()
        gpac.motion.move_absolute(gpac.Group("arm", joint), goal=[0.1])
        assert segment.drives()[0].position == 1000
