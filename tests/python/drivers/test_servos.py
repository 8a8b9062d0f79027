# SPDX-License-Identifier: Apache-2.0
"""Servos on a serial bus: the emulated servos are tested with third-party software for real ones, the drivers with the emulated ones.

Latencies are long enough for the slowest machine; no test waits for them to expire.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import dynamixel_sdk
import numpy as np
import pytest
import rustypot
import scservo_sdk

import opengpac as gpac
from afar import until
from opengpac import activate, library
from servo_kits import opened

PATIENT: dict[str, Any] = {"latency": "60 s", "age_max": "60 s"}
KINDS = ["feetech", "dynamixel"]


def test_rustypot_drives_emulated_feetech_servos() -> None:
    with gpac.drivers.fake.servos("feetech", follow=1.0) as bus:
        peer = rustypot.Sts3215PyController(serial_port=bus.port, baudrate=1_000_000, timeout=300.0)
        assert peer.ping(1)
        assert peer.sync_read_raw_present_position([1, 2, 3, 4, 5, 6]) == [2048] * 6
        peer.sync_write_raw_goal_position([1, 2], [1000, 3000])
        peer.sync_write_torque_enable([1], [True])
        assert peer.sync_read_raw_present_position([1, 2]) == [1000, 2048]
        assert (bus[1].torque, bus[2].torque) == (True, False)


def test_rustypot_drives_emulated_dynamixel_servos() -> None:
    with gpac.drivers.fake.servos("dynamixel", follow=1.0) as bus:
        peer = rustypot.Xl330PyController(serial_port=bus.port, baudrate=1_000_000, timeout=300.0)
        assert peer.ping(6)
        peer.sync_write_torque_enable([1, 2], [True, True])
        peer.sync_write_raw_goal_position([1, 2], [1000, 3000])
        assert peer.sync_read_raw_present_position([1, 2, 3]) == [1000, 3000, 2048]


def test_feetech_servo_sdk_drives_emulated_servos() -> None:
    with gpac.drivers.fake.servos("feetech", follow=1.0) as bus:
        port, kit = opened(scservo_sdk.PortHandler, bus), scservo_sdk.PacketHandler(0)
        assert kit.ping(port, 3) == (777, 0, 0)
        assert kit.write2ByteTxRx(port, 1, 42, 1500) == (0, 0)
        assert kit.write1ByteTxRx(port, 1, 40, 1) == (0, 0)
        assert kit.read2ByteTxRx(port, 1, 56) == (1500, 0, 0)
        bus[2].error = 32
        assert kit.read1ByteTxRx(port, 2, 65) == (32, 0, scservo_sdk.ERRBIT_OVERLOAD)
        together = scservo_sdk.GroupSyncRead(port, kit, 56, 4)
        assert all(together.addParam(id) for id in (1, 3))
        assert together.txRxPacket() == 0
        assert [together.getData(id, 56, 2) for id in (1, 3)] == [1500, 2048]
        port.closePort()


def test_dynamixel_sdk_drives_emulated_servos() -> None:
    with gpac.drivers.fake.servos("dynamixel", follow=1.0) as bus:
        port, kit = opened(dynamixel_sdk.PortHandler, bus), dynamixel_sdk.PacketHandler(2.0)
        assert kit.ping(port, 3) == (1200, 0, 0)
        assert kit.write1ByteTxRx(port, 1, 64, 1) == (0, 0)
        assert kit.write4ByteTxRx(port, 1, 116, 1500) == (0, 0)
        assert kit.read4ByteTxRx(port, 1, 132) == (1500, 0, 0)
        assert kit.write1ByteTxRx(port, 1, 11, 4) == (0, 7), "no mode is changed under torque"
        assert kit.write4ByteTxRx(port, 1, 116, 5000) == (0, 6), "a goal is within its limits"
        stuffed = [255, 255, 253, 255, 255, 253]
        assert kit.writeTxRx(port, 1, 224, 6, stuffed) == (0, 0)
        assert kit.readTxRx(port, 1, 224, 6) == (stuffed, 0, 0)
        bus[2].error = 32
        assert kit.read1ByteTxRx(port, 2, 70) == (32, 0, 0x80)
        assert kit.reboot(port, 2) == (0, 0)
        assert bus[2].error == 0
        port.closePort()


class Bench:
    """Bus of two servos, `a` and `b`, in a system under the virtual clock: each firing is an exchange."""

    def __init__(self, kind: str, **options: Any) -> None:
        self.bus = gpac.drivers.fake.servos(kind, ids=[1, 2], follow=1.0)
        self.cell = gpac.System("cell", clock="virtual")
        self.fast = self.cell.processor("rtp0").timer("fast", period="10 ms", priority=80)
        servos = {"a": {"id": 1}, "b": {"id": 2, "direction": -1}}
        driver = getattr(gpac.drivers, kind)(self.bus.port, servos, **{**PATIENT, **options})
        self.device = self.fast.processor.physical_device("arm", driver, exchange=self.fast)

    def hold(self, goal: float) -> Any:
        """Starts a verb that writes a goal of `a`."""
        store = gpac.Verb(
            "store",
            blocks={"write": library.write_channel},
            instantiation_parameters={"goal": "write.channel", "value": "write.u"},
            modes={"write.u": "asynchronous"},
            command_lists={"start": [activate("write", every="10 ms")]},
        )
        return store.asynch(self.device["a"].goal, self.cell.svv("value", unit="rad", initial=goal))

    def comes(self, holds: Any, what: str) -> None:
        """Exchanges until a condition holds."""
        for _ in range(500):
            if holds():
                return
            self.cell.advance("10 ms")
        raise AssertionError(f"not within 500 exchanges: {what}")


@pytest.fixture(params=KINDS)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    bench = Bench(request.param)
    yield bench
    bench.cell.close()
    bench.bus.close()


def test_a_servo_follows_its_goal_within_its_speed_and_loses_its_torque(bench: Bench) -> None:
    bus = bench.bus
    bus[1].store(42 if bus.table.wide == 2 else 116, bus.table.wide, 3000)
    held = bench.hold(0.5)
    bench.comes(lambda: bus[1].torque, "torque is on")
    assert bus[1].goal < 2048 + 100, "the goal that it had is forgotten"
    bench.comes(lambda: abs(bus[1].position - 2374) <= 1, "it is there")
    assert (bus[2].torque, bus[2].position) == (False, 2048)
    held.halt()
    bench.comes(lambda: not bus[1].torque, "torque is off")


def test_a_position_is_an_angle_with_its_sign(bench: Bench) -> None:
    bench.bus[2].position = 3072
    reader = gpac.Verb(
        "reader",
        blocks={"read": library.read_channel},
        instantiation_parameters={"of": "read.channel", "value": "read.y"},
        command_lists={"start": [activate("read", every="10 ms")]},
    )
    value = bench.cell.svv("angle", unit="rad")
    reader.asynch(bench.device["b"].position, value)
    bench.comes(lambda: np.isclose(value.value, -np.pi / 2), "a quarter of a turn, the other way round")


def test_lost_and_garbled_answers_are_asked_for_again() -> None:
    bench = Bench("feetech", latency="2 s", retries=3)
    with bench.bus as bus:
        held = bench.hold(0.1)
        bus.garble = 1
        bench.comes(lambda: bus.garble == 0, "wrong answers were given")
        bus.mute = 1
        bench.comes(lambda: bus.mute == 0, "requests were not answered")
        bench.comes(lambda: abs(bus[1].position - 2113) <= 1, "it is there all the same")
        assert held.state == "running"
        bench.cell.close()


def test_a_servo_that_is_not_there_is_named() -> None:
    with gpac.drivers.fake.servos("feetech", ids=[1]) as bus:
        cell = gpac.System("cell", clock="virtual")
        fast = cell.processor("rtp0").timer("fast", period="10 ms", priority=80)
        driver = gpac.drivers.feetech(bus.port, {"a": {"id": 1}, "b": {"id": 7}}, latency="3 s", retries=0)
        bus.servos[1].follow = 1.0
        with pytest.raises(gpac.DeviceFailed, match=r"servo 'b' \(id 7\).*does not answer at 1000000 baud.*a scan, which finds ids"):
            fast.processor.physical_device("arm", driver, exchange=fast)
        cell.close()


@pytest.fixture
def so101() -> Iterator[tuple[gpac.drivers.fake.FakeServos, gpac.robots.Arm]]:
    with gpac.drivers.fake.servos("feetech") as bus:
        arm = gpac.robots.load("so101", driver=gpac.drivers.feetech(bus.port, **PATIENT), clock="virtual")
        yield bus, arm
        arm.system.close()


GOAL = [0.2, -0.2, 0.3, 0.0, 0.1, 0.5]


def positions(bus: gpac.drivers.fake.FakeServos) -> list[float]:
    """Returns the positions of all servos, rad."""
    return [(servo.position - 2048) * 2 * np.pi / 4096 for servo in bus.servos.values()]


def test_an_so101_obeys_the_motion_verbs(so101: tuple[gpac.drivers.fake.FakeServos, gpac.robots.Arm]) -> None:
    bus, arm = so101
    assert [joint.name for joint in arm] == [
        f"so101.{name}" for name in ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
    ]
    arm.enable()
    moved = gpac.robots.move(arm, GOAL, speed=1.0, tolerance=0.01)
    assert np.allclose(moved.position, GOAL, atol=0.01) and np.allclose(positions(bus), GOAL, atol=0.02)
    gpac.motion.move_absolute(arm, [0.0] * 6)
    assert np.allclose(positions(bus), 0.0, atol=0.02)
    arm.disable()
    assert until(lambda: not any(servo.torque for servo in bus.servos.values()), "torque is off")


def test_an_so101_that_is_unplugged_is_lost_and_comes_back_where_it_is(so101: tuple[gpac.drivers.fake.FakeServos, gpac.robots.Arm]) -> None:
    bus, arm = so101
    arm.enable()
    gpac.robots.move(arm, GOAL, tolerance=0.01)
    bus.unplug()
    arm.system.advance("100 ms")
    assert {joint.state for joint in arm} == {"fault"}
    with pytest.raises(gpac.DeviceFailed, match=r"the serial line .* cannot be opened"):
        arm.system.physical_devices["so101"].reopen()
    for servo in bus.servos.values():
        servo.position = servo.position - 100
    where = positions(bus)
    bus.plug()
    arm.system.reset()
    arm.enable()
    arm.system.advance("100 ms")
    assert np.allclose(positions(bus), where, atol=0.005), "nothing leaps to the goal that was"
    moved = gpac.robots.move(arm, GOAL, tolerance=0.01)
    assert np.allclose(moved.position, GOAL, atol=0.01)


def test_an_so101_with_a_driver_has_no_geometry() -> None:
    with gpac.drivers.fake.servos("feetech") as bus:
        arm = gpac.robots.load("so101", driver=gpac.drivers.feetech(bus.port, **PATIENT), clock="virtual")
        with arm.system, pytest.raises(gpac.DefinitionError, match="the geometry of 'so101' is unknown"):
            arm.forward([0.0] * 6)


def test_the_exchange_has_a_thread_of_its_own_in_real_time() -> None:
    with gpac.drivers.fake.servos("feetech") as bus:
        arm = gpac.robots.load("so101", driver=gpac.drivers.feetech(bus.port, **PATIENT))
        arm.enable()
        assert until(lambda: all(servo.torque for servo in bus.servos.values()), "torque is on")
        arm.system.close()
        assert until(lambda: not any(servo.torque for servo in bus.servos.values()), "torque is off")
