# SPDX-License-Identifier: Apache-2.0
"""Modbus devices as physical devices: signals read and write them, they are lost and reconnect."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import pytest

import modbus_peers
import opengpac as gpac
from afar import until
from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput, set_output

CHANNELS = {
    "level": {"input": 0, "type": "int16", "scale": 0.1, "unit": "mm"},
    "flow": {"input": 1, "type": "float", "unit": "m/s"},
    "ready": {"discrete": 5},
    "alarm": {"holding": 20, "bit": 3},
    "speed": {"holding": 10, "type": "float", "unit": "Hz", "write": True, "safe": -1.0},
    "torque": {"holding": 12, "type": "int16", "scale": 0.5, "unit": "N.m", "write": True},
    "valve": {"coil": 7, "write": True},
    "lamp": {"coil": 8, "write": "each", "safe": True},
}
# No machine is this slow: answers here depend on the test's own threads.
PATIENT: dict[str, Any] = {"answer": "30 s", "age_max": "60 s"}


@pytest.fixture(params=["fake tcp", "fake rtu", "pymodbus tcp", "pymodbus rtu"])
def peer(request: pytest.FixtureRequest) -> Iterator[Any]:
    """Yields a device: our emulated one for users' tests, or pymodbus, over TCP and over a serial line."""
    whose, how = request.param.split()
    if whose == "pymodbus":
        with (modbus_peers.tcp if how == "tcp" else modbus_peers.rtu)() as made:
            yield made
        return
    with gpac.drivers.fake.modbus(serial=how == "rtu") as made:
        for at in range(64):
            made.coil[at] = made.discrete[at] = False
            made.holding[at] = made.input[at] = 0
        yield made


@pytest.fixture
def virtual() -> Iterator[gpac.System]:
    """Yields a system under the virtual clock, whose devices are exchanged within each firing."""
    with gpac.System("cell", clock="virtual", seed=1) as cell:
        yield cell


def test_signals_read_and_write_a_device(virtual: gpac.System, peer: Any) -> None:
    peer.put("input", 0, -123, "int16")
    peer.put("input", 1, 1.5, "float")
    peer.put("discrete", 5, 1)
    peer.put("holding", 20, 0b1000)
    rtp = virtual.processor("rtp0")
    slow = rtp.timer("slow", period="10 ms", priority=60)
    plc = rtp.physical_device("plc", gpac.drivers.modbus(peer.address, channels=CHANNELS, **PATIENT), exchange=slow)
    level, flow = AnalogInput("level", plc["level"]), AnalogInput("flow", plc["flow"])
    ready, alarm = DigitalInput("ready", plc["ready"]), DigitalInput("alarm", plc["alarm"])
    speed, torque = AnalogOutput("speed", plc["speed"], low=-100, high=100), AnalogOutput("torque", plc["torque"], low=-100, high=100)
    valve, lamp = DigitalOutput("valve", plc["valve"]), DigitalOutput("lamp", plc["lamp"])
    virtual.advance("20 ms")
    written = [("holding", 10, "float"), ("holding", 12, "int16"), ("coil", 7, ""), ("coil", 8, "")]
    assert [peer.get(*place) for place in written] == [-1.0, 0, False, True], "safe, as nobody commands it"
    for device in (level, flow, ready, alarm, speed, torque, valve, lamp):
        device.enable()
    assert [level.value.value, flow.value.value, ready.value.value, alarm.value.value] == [pytest.approx(-12.3), 1.5, True, True]
    set_output(speed, 42.5)
    set_output(torque, -7.5)
    set_output(valve, True)
    virtual.advance("20 ms")
    assert [peer.get(*place) for place in written] == [42.5, -15, True, False]
    peer.put("input", 0, 500, "int16")
    virtual.advance("20 ms")
    assert level.value.value == 50.0
    speed.disable()
    virtual.advance("20 ms")
    assert peer.get("holding", 10, "float") == -1.0
    virtual.emergency_stop("test")
    virtual.advance("20 ms")
    assert [peer.get(*place) for place in written] == [-1.0, 0, False, True]


def test_bits_and_bytes_of_a_register_are_written_and_its_others_stay(virtual: gpac.System, peer: Any) -> None:
    channels = {
        "run": {"holding": 20, "bit": 1, "write": True},
        "ready": {"holding": 20, "bit": 6, "write": True},
        "level": {"holding": 20, "byte": "high", "scale": 0.5, "unit": "V", "write": True},
        "alarm": {"holding": 20, "bit": 0},
        "shown": {"holding": 20, "byte": "high", "scale": 0.5},
    }
    peer.put("holding", 20, 0b0100_0001)
    rtp = virtual.processor("rtp0")
    slow = rtp.timer("slow", period="10 ms", priority=60)
    plc = rtp.physical_device("plc", gpac.drivers.modbus(peer.address, channels=channels, **PATIENT), exchange=slow)
    run, level = DigitalOutput("run", plc["run"]).enable(), AnalogOutput("level", plc["level"], low=0, high=200).enable()
    alarm, shown = DigitalInput("alarm", plc["alarm"]).enable(), AnalogInput("shown", plc["shown"]).enable()
    set_output(run, True)
    set_output(level, 2.5)
    virtual.advance("30 ms")
    assert peer.get("holding", 20) == 0b0000_0101_0000_0011, "bit 6 is safe, bit 0 is nobody's"
    assert [alarm.value.value, shown.value.value] == [True, 2.5]
    peer.put("holding", 20, 0b1000_0000_0000_0010 + (5 << 8))
    set_output(run, False)
    virtual.advance("30 ms")
    assert peer.get("holding", 20) == 0b1000_0000_0000_0000 + (5 << 8), "what another master wrote stays"
    set_output(level, 200)
    virtual.advance("30 ms")
    assert peer.get("holding", 20) == 0xFF00, "it saturates"
    virtual.emergency_stop("test")
    virtual.advance("30 ms")
    assert peer.get("holding", 20) == 0, "each part has its safe value"


def test_one_that_is_switched_off_is_lost_and_comes_back(virtual: gpac.System) -> None:
    with gpac.drivers.fake.modbus() as device:
        device.put("input", 0, 1)
        device.put("coil", 0, 0)
        rtp = virtual.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        channels = {"level": {"input": 0}, "valve": {"coil": 0, "write": True}}
        plc = rtp.physical_device("plc", gpac.drivers.modbus(device.address, channels=channels, **PATIENT), exchange=slow)
        level, valve = AnalogInput("level", plc["level"]).enable(), DigitalOutput("valve", plc["valve"]).enable()
        set_output(valve, True)
        device.stop()
        virtual.advance("30 ms")
        assert (level.state, valve.state) == ("fault", "fault")
        assert [(alarm.code, alarm.source, alarm.state) for alarm in virtual.alarms] == [("device_lost", "plc", "active")]
        with pytest.raises(gpac.DeviceFailed, match=r"unit 1 at 127.0.0.1:[0-9]+ did not read input 0: it cannot be opened: .*refused"):
            level.enable()
        device.put("input", 0, 2)
        device.start()
        virtual.reset()
        virtual.advance("20 ms")
        assert device.get("coil", 0) == 0, "what it was commanded before is over"
        level.enable()
        valve.enable()
        assert level.value.value == 2.0


def test_units_on_one_line_share_it_and_a_dead_one_is_lost_alone() -> None:
    with gpac.drivers.fake.modbus(units=(1, 2, 3), serial=True) as line, gpac.System("cell") as cell:
        for unit, tables in line.units.items():
            tables.put("input", 0, 10 * unit)
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        levels = []
        for unit in (1, 2, 3):
            made = gpac.drivers.modbus(
                line.address, unit=unit, channels={"level": {"input": 0}}, answer="0.3 s", age_max="60 s", retries=20 if unit == 2 else 100
            )
            device = rtp.physical_device(f"unit{unit}", made, exchange=slow)
            levels.append(AnalogInput(f"level{unit}", device["level"]).enable())
        assert [level.value.value for level in levels] == [10.0, 20.0, 30.0]
        line.silent.add(2)
        until(lambda: levels[1].state == "fault", "the silent unit is lost")
        for unit, tables in line.units.items():
            tables.put("input", 0, 11 * unit)
        until(lambda: [levels[0].value.value, levels[2].value.value] == [11.0, 33.0], "the others are read")
        assert [level.state for level in (levels[0], levels[2])] == ["standstill", "standstill"]
        line.silent.clear()
        cell.reset()
        levels[1].enable()
        assert levels[1].value.value == 22.0


def test_ten_devices_of_which_one_is_dead() -> None:
    channels = {f"r{at}": {"holding": at} for at in range(100)}
    with contextlib.ExitStack() as stack:
        peers = [stack.enter_context(gpac.drivers.fake.modbus()) for _ in range(10)]
        for peer in peers:
            peer.holding.update(dict.fromkeys(range(100), 0))
        cell = stack.enter_context(gpac.System("cell"))
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        lasts = []
        for at, peer in enumerate(peers):
            made = gpac.drivers.modbus(peer.address, channels=channels, answer="20 s", age_max="60 s")
            device = rtp.physical_device(f"plc{at}", made, exchange=slow)
            lasts.append(AnalogInput(f"last{at}", device["r99"]).enable())
        peers[3].silent.add(1)
        until(lambda: peers[3].requests[1] > 0, "the dead one has been asked")
        for peer in peers:
            peer.holding[99] = 7
        before = [peer.requests[1] for peer in peers]
        alive = [at for at in range(10) if at != 3]
        until(lambda: all(peers[at].requests[1] > before[at] + 20 for at in alive), "the others are asked on")
        until(lambda: all(lasts[at].value.value == 7.0 for at in alive), "the others are read on")
        assert [last.state for last in lasts] == ["standstill"] * 10, "it is not lost yet: it may still answer"
        assert peers[3].requests[1] <= before[3] + 2, "100 registers are one request"


def test_what_is_wrong_in_a_declaration_is_named(virtual: gpac.System) -> None:
    rtp = virtual.processor("rtp0")
    slow = rtp.timer("slow", period="10 ms", priority=60)
    with pytest.raises(gpac.Error, match=r"option 'channels': 'x': give its address in one table"):
        rtp.physical_device("plc", gpac.drivers.modbus("tcp/127.0.0.1", channels={"x": {}}), exchange=slow)
    with pytest.raises(gpac.CallError, match="channel 'x' must be a dictionary, not 3"):
        gpac.drivers.modbus("tcp/127.0.0.1", channels={"x": 3})  # type: ignore[dict-item]


def test_the_search_finds_units_on_a_line_and_devices_at_addresses() -> None:
    with gpac.drivers.fake.modbus(units=[3, 17], serial=True) as line:
        found = [gpac.drivers.scan("modbus", address=line.address, unit=unit, answer_ns=30_000_000_000) for unit in (3, 17)]
        assert [one[0]["options"] for one in found] == [{"address": line.address, "unit": unit} for unit in (3, 17)]
        assert "OpenGPAC fake 1" in found[0][0]["what"]
        line.silent.add(17)
        assert gpac.drivers.scan("modbus", address=line.address, unit=17, answer_ns=1_000_000) == []
    with gpac.drivers.fake.modbus() as one, gpac.drivers.fake.modbus() as other:
        found = gpac.drivers.scan("modbus", address=f"{one.address}, {other.address}", answer_ns=30_000_000_000)
        assert [one["options"]["address"] for one in found] == [one.address, other.address]
    with pytest.raises(gpac.Error, match="give the place to search"):
        gpac.drivers.scan("modbus")


def test_a_device_that_nothing_makes_safe_is_named_when_it_is_enabled(caplog: pytest.LogCaptureFixture) -> None:
    with gpac.drivers.fake.modbus() as peer, gpac.System("cell") as cell:
        for at in range(64):
            peer.coil[at] = peer.discrete[at] = False
            peer.holding[at] = peer.input[at] = 0
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        plc = rtp.physical_device("plc", gpac.drivers.modbus(peer.address, channels=CHANNELS, **PATIENT), exchange=slow)
        arm = rtp.physical_device("arm", gpac.drivers.loopback("x"), exchange=slow)
        valve, lamp = DigitalOutput("valve", plc["valve"]), DigitalOutput("lamp", plc["lamp"])
        for output in (valve, lamp):
            output.enable()
        said = [record.getMessage() for record in caplog.records if "continues to execute its last commands" in record.getMessage()]
        assert len(said) == 1 and "'plc'" in said[0], "once, and of a simulation nothing"
        assert [entry["about"] for entry in cell.log() if entry["kind"] == "guard"] == ["plc"]
        assert plc.about["unguarded"] and not arm.about.get("unguarded")
