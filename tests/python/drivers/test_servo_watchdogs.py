# SPDX-License-Identifier: Apache-2.0
"""The watchdog of Dynamixel servos: set by the driver, honoured by the emulated servos, as seen by the maker's own kit."""

from __future__ import annotations

from typing import Any

import dynamixel_sdk
import pytest

import opengpac as gpac
from servo_kits import opened

WATCHDOG, TORQUE, GOAL, POSITION = 98, 64, 116, 132
RANGE_ERROR = 4


class Clock:
    """Clock that the test advances, s."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_an_emulated_servo_that_hears_nothing_stands_and_takes_no_goals_as_the_makers_kit_sees_it() -> None:
    clock = Clock()
    with gpac.drivers.fake.servos("dynamixel", [1], clock=clock) as bus:
        port, kit = opened(dynamixel_sdk.PortHandler, bus), dynamixel_sdk.PacketHandler(2.0)
        try:
            assert kit.write1ByteTxRx(port, 1, WATCHDOG, 5) == (0, 0) and kit.write1ByteTxRx(port, 1, TORQUE, 1) == (0, 0)
            clock.now += 0.1
            assert kit.write4ByteTxRx(port, 1, GOAL, 3000) == (0, 0), "within its time"
            clock.now += 0.11
            assert kit.write4ByteTxRx(port, 1, GOAL, 3500) == (0, RANGE_ERROR)
            assert kit.read1ByteTxRx(port, 1, WATCHDOG) == (0xFF, 0, 0) and bus[1].stopped
            stood, _, _ = kit.read4ByteTxRx(port, 1, POSITION)
            assert kit.read4ByteTxRx(port, 1, POSITION)[0] == stood
            assert kit.write1ByteTxRx(port, 1, WATCHDOG, 0) == (0, 0), "this lets it go on"
            assert kit.write4ByteTxRx(port, 1, GOAL, 3500) == (0, 0)
            # Without torque the watchdog is inactive.
            assert kit.write1ByteTxRx(port, 1, TORQUE, 0) == (0, 0) and kit.write1ByteTxRx(port, 1, WATCHDOG, 1) == (0, 0)
            clock.now += 10.0
            assert kit.read1ByteTxRx(port, 1, WATCHDOG) == (1, 0, 0)
        finally:
            port.closePort()


def line(bus: Any, cell: gpac.System, **options: Any) -> gpac.PhysicalDevice:
    """Returns two servos, exchanged each 10 ms."""
    fast = cell.processor("rtp0").timer("fast", period="10 ms", priority=60)
    servos = {"a": {"id": 1}, "b": {"id": 2}}
    return fast.processor.physical_device(
        "line", gpac.drivers.dynamixel(bus.port, servos, latency="60 s", echo=False, **options), exchange=fast
    )


def test_the_driver_sets_it_with_the_torque_and_tells_when_it_has_tripped() -> None:
    clock = Clock()
    with gpac.drivers.fake.servos("dynamixel", [1, 2], clock=clock) as bus, gpac.System("cell", clock="virtual") as cell:
        device = line(bus, cell, watchdog="0.1 s")
        assert device.about["watchdog_ns"] == 100_000_000
        joint = gpac.robots.Joint("a", drive=device["a"]).enable()
        cell.advance("50 ms")
        assert bus[1].value(WATCHDOG, 1) == 5 and bus[1].torque
        assert bus[2].value(WATCHDOG, 1) == 0, "one without torque watches nothing"
        moving = gpac.motion.move_absolute.asynch(joint, 1.0)
        cell.advance("0.2 s")
        # This host hangs.
        clock.now += 0.5
        with pytest.raises(gpac.Terminated) as ended:
            moving.wait()
        assert ended.value.condition == "device_lost"
        assert "was stopped by its own watchdog" in ended.value.message, "what the motion raises says why"
        assert (
            "servo 'a' (id 1)" in (told := str(cell.log()))
            and "was stopped by its own watchdog: there was no request on the line for 100 ms" in told
        )
        cell.reset()
        joint.enable()
        assert not bus[1].stopped
        assert gpac.motion.move_absolute(joint, 1.0).condition == "arrived"


def test_without_the_option_none_is_set() -> None:
    with gpac.drivers.fake.servos("dynamixel", [1, 2]) as bus, gpac.System("cell", clock="virtual") as cell:
        device = line(bus, cell)
        gpac.robots.Joint("a", drive=device["a"]).enable()
        cell.advance("50 ms")
        assert bus[1].torque and bus[1].value(WATCHDOG, 1) == 0 and "watchdog_ns" not in device.about


@pytest.mark.parametrize("watchdog", ["10 ms", "30 ms", "2.56 s"])
def test_a_time_that_its_register_cannot_hold_is_refused(watchdog: str) -> None:
    with (
        gpac.drivers.fake.servos("dynamixel", [1, 2]) as bus,
        gpac.System("cell", clock="virtual") as cell,
        pytest.raises(gpac.DeviceFailed, match=r"20 ms to 2\.54 s"),
    ):
        line(bus, cell, watchdog=watchdog)


def test_its_manual_says_who_brings_about_what() -> None:
    assert "a servo that gets no request stands still by itself" in gpac.drivers.show("dynamixel").safe_state["doc"]
    assert "watchdog" not in gpac.drivers.show("feetech").safe_state["doc"]
