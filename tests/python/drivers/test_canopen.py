# SPDX-License-Identifier: Apache-2.0
"""Axes on CANopen as joints of a cell, on an emulated bus that runs on the cell's time."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen as canopen_package
import pytest

import opengpac as gpac
from drivers.canopen_peer import dictionary

fake = gpac.drivers.fake
NODE = 5


@pytest.fixture
def bus() -> Iterator[fake.CanOpenBus]:
    with fake.canopen({"name": "x", "node": NODE, "position": 1000, "watchdog": False}) as bus:
        yield bus


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("cell", clock="virtual", progress=False) as cell:
        yield cell


def joint(cell: gpac.System, interface: str, **options: Any) -> gpac.robots.Joint:
    """Returns the axis as a joint."""
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="10 ms", priority=80)
    axis = {"node": NODE, "counts": 1000, "range": [-10, 10], "speed_max": 5.0}
    line = rtp.physical_device("line", gpac.drivers.canopen(interface, {"x": axis}, **options), exchange=fast)
    return gpac.robots.Joint("j", drive=line["x"], on=fast, verb=gpac.robots.joint_follower, max_following_error=10.0)


def lost(cell: gpac.System) -> str:
    """Advances time until the device is lost, and returns the reason."""
    cell.advance("0.6 s")
    about = str(cell.statistics["physical_devices"]["line"]["lost"])
    assert about != "None", "the device is still there"
    return about


def test_an_axis_is_a_joint_and_its_objects_are_read(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    x = joint(cell, bus.interface).enable()
    gpac.motion.move_absolute(gpac.Group("arm", x), goal=[1.5])
    line = cell.physical_devices["line"]
    assert (x.sensed.value, bus.drives()[0].position, bus.drives()[0].drive) == (1.5, 1500, "operation enabled")
    assert line.services.read_object(axis="x", index=0x1000)["number"] & 0xFFFF == 402
    line.services.save(axis="x")
    assert line.counters["cycles"] > 0 and line.counters["frames_lost"] == 0


def test_what_a_motion_raises_says_what_the_drive_found_wrong(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    x = joint(cell, bus.interface).enable()
    moving = gpac.motion.move_absolute.asynch(gpac.Group("arm", x), goal=[5.0])
    cell.advance("0.1 s")
    bus.fail(NODE, 0x2310)
    with pytest.raises(gpac.Terminated, match=r"node 5\)? .*0x2310: continuous over-current"):
        moving.wait()


def test_a_drive_that_was_switched_off_is_configured_again_and_stays_where_it_is(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    x = joint(cell, bus.interface).enable()
    gpac.motion.move_absolute(gpac.Group("arm", x), goal=[1.5])
    bus.power(NODE, False)
    assert "node 5 (axis 'x') sent no process data for 3 cycles" in lost(cell)
    bus.power(NODE, True)
    assert bus.drives()[0].state == "pre-operational"
    cell.reset()
    cell.advance("0.1 s")
    assert (bus.drives()[0].state, bus.drives()[0].drive) == ("operational", "switch on disabled")
    x.enable()
    cell.advance("0.1 s")
    assert (x.sensed.value, bus.drives()[0].drive) == (1.5, "operation enabled")


def test_a_fault_is_named_by_its_emergency(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    joint(cell, bus.interface).enable()
    bus.fail(NODE)
    assert "axis 'x' (node 5) has a fault, 0x7121: motor blocked" in lost(cell)
    assert cell.physical_devices["line"].counters["emergencies"] == 1


def test_an_adapter_that_left_the_bus_is_named(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    joint(cell, bus.interface).enable()
    bus.bus_off()
    assert "bus off" in lost(cell)


def test_a_bus_of_the_driver_needs_nothing_else(cell: gpac.System) -> None:
    x = joint(cell, "emulated").enable()
    gpac.motion.move_absolute(gpac.Group("arm", x), goal=[0.5])
    assert x.sensed.value == 0.5


def test_nodes_are_found(bus: fake.CanOpenBus) -> None:
    found = gpac.drivers.scan("canopen", interface=bus.interface)
    assert [each["what"].split(",")[0] for each in found] == ["node 5: 'x'"]


def test_what_is_wrong_is_refused_with_its_remedy(cell: gpac.System) -> None:
    with pytest.raises(gpac.CallError, match="must be a dictionary"):
        gpac.drivers.canopen("can0", {"x": 5})  # type: ignore[dict-item]
    with pytest.raises(gpac.Error, match=r"option 'axes\.x\.node': it cannot be 200: its range is 1 to 127"):
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="10 ms", priority=80)
        rtp.physical_device("line", gpac.drivers.canopen("can0", {"x": {"node": 200, "counts": 1}}), exchange=fast)


def test_an_axis_is_homed_by_its_drive(cell: gpac.System) -> None:
    with fake.canopen({"name": "x", "node": NODE, "position": 1000, "watchdog": False, "limits": [-2000, 5000]}) as bus:
        x = joint(cell, bus.interface)
        line = cell.physical_devices["line"]
        with concurrent.futures.ThreadPoolExecutor() as pool:
            homing = pool.submit(line.services.home, axis="x", method=17, speed=10.0, position=0.5)
            while not homing.done():
                cell.advance("10 ms")
            homing.result()
        cell.advance("0.1 s")
        assert (bus.drives()[0].position, bus.drives()[0].drive) == (500, "switch on disabled")
        x.enable()
        gpac.motion.move_absolute(gpac.Group("arm", x), goal=[0.6])
        assert (bus.drives()[0].position, bus.drives()[0].mode) == (600, 8)


@pytest.fixture
def terminals() -> Iterator[fake.CanOpenBus]:
    module = {"inputs": 8, "outputs": 8, "analog_inputs": 1, "analog_outputs": 1}
    with fake.canopen({"name": "io", "node": 7, "watchdog": False, "module": module}) as bus:
        yield bus


def module(cell: gpac.System, bus: fake.CanOpenBus, channels: dict[str, Any], **options: Any) -> gpac.PhysicalDevice:
    """Returns a module with these channels."""
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="10 ms", priority=80)
    driver = gpac.drivers.canopen(bus.interface, modules={"io": {"node": 7, "channels": channels, **options}})
    return rtp.physical_device("line", driver, exchange=fast)


def test_terminals_of_a_module_are_inputs_and_outputs_of_a_cell(terminals: fake.CanOpenBus, cell: gpac.System) -> None:
    from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput, set_output

    bus = terminals
    line = module(cell, bus, {
        "door": {"input": 5}, "lamp": {"output": 2, "safe": True},
        "level": {"analog_input": 0, "scale": 0.001, "unit": "m"}, "valve": {"analog_output": 0, "scale": 0.01, "unit": "V", "safe": 1.0},
    })  # fmt: skip
    door, level = DigitalInput("door", line["io.door"]).enable(), AnalogInput("level", line["io.level"]).enable()
    lamp, valve = DigitalOutput("lamp", line["io.lamp"]).enable(), AnalogOutput("valve", line["io.valve"], low=0, high=10).enable()
    bus.put(7, "input", 5, True)
    bus.put(7, "analog_input", 0, -1500)
    set_output(lamp, False)
    set_output(valve, 2.5)
    cell.advance("50 ms")
    (there,) = bus.modules()
    assert (door.value.value, level.value.value) == (True, -1.5)
    assert (there.outputs[2], there.analog_outputs, there.state) == (False, [250], "operational")
    cell.emergency_stop("tried")
    cell.advance("50 ms")
    (there,) = bus.modules()
    assert (there.outputs[2], there.analog_outputs) == (True, [100]), "safe"


def test_while_an_emergency_stop_is_latched_only_settings_are_written(cell: gpac.System) -> None:
    with fake.canopen({"name": "x", "node": NODE, "watchdog": False}) as bus:
        joint(cell, bus.interface)
        write = cell.physical_devices["line"].services.write_object
        write(axis="x", index=0x6060, value=8, bits=8)
        cell.emergency_stop("tried")
        write(axis="x", index=0x6065, value=777, bits=32)
        with pytest.raises(gpac.Error, match="object 0x6040:0 is its control word, but an emergency stop is latched"):
            write(axis="x", index=0x6040, value=15, bits=16)
        cell.reset()
        write(axis="x", index=0x6040, value=6, bits=16)


def test_an_eds_file_that_another_program_wrote_names_the_objects(bus: fake.CanOpenBus, cell: gpac.System, tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    objects = dictionary(NODE)
    objects[0x1018]["vendor"].default, objects[0x1018]["product"].default = 0x6A1C, 0x402
    canopen_package.export_od(objects, str(path))
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="10 ms", priority=80)
    driver = gpac.drivers.canopen(bus.interface, {"x": {"node": NODE, "counts": -1000, "eds": path}})
    line = rtp.physical_device("line", driver, exchange=fast)
    assert line.services.read_object(axis="x", object="identity.product")["number"] == 0x402
    assert line.services.read_object(axis="x", object="position")["number"] == 1000
    line.services.write_object(axis="x", object="Target Torque", value=-3)
    assert line.services.read_object(axis="x", object="target torque")["number"] == -3
    with pytest.raises(gpac.Error, match="contains no object 'positon'"):
        line.services.read_object(axis="x", object="positon")


def test_enabling_waits_for_the_drive_and_nothing_moves_when_it_comes(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    x = joint(cell, bus.interface)
    bus.enable_input(NODE, False)
    cell.advance("0.1 s")
    assert not cell.read(cell.physical_devices["line"]["x"].operating)[0]
    with pytest.raises(TimeoutError, match="'j' was not ready within 1 s; it is enabling"):
        x.enable(timeout="1 s")
    bus.enable_input(NODE, True)
    cell.advance("0.5 s")
    assert (x.state, bus.drives()[0].drive, bus.drives()[0].position) == ("disabled", "switch on disabled", 1000)
    x.enable()
    assert (bus.drives()[0].drive, x.sensed.value, x.commanded.value) == ("operation enabled", 1.0, 1.0)


def test_a_drive_that_does_not_come_is_lost_with_its_status_in_words(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    x = joint(cell, bus.interface)
    bus.enable_input(NODE, False)
    late = "did not come into operation within 3 s of being enabled: it is in 'switch on disabled'"
    with pytest.raises(gpac.Terminated, match=late) as end:
        x.enable()
    assert end.value.condition == "device_lost"
    bus.enable_input(NODE, True)
    cell.advance("1 s")
    assert (bus.drives()[0].drive, bus.drives()[0].position) == ("switch on disabled", 1000)
    cell.reset()
    x.enable()
    gpac.motion.move_absolute(gpac.Group("arm", x), goal=[1.5])
    assert bus.drives()[0].position == 1500


def test_no_motion_starts_before_the_drive_is_there(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    x = joint(cell, bus.interface)
    bus.enable_input(NODE, False)
    with pytest.raises(TimeoutError):
        x.enable(timeout="10 ms")
    with pytest.raises(gpac.NotEnabled):
        gpac.motion.move_absolute(gpac.Group("arm", x), goal=[1.5])


def test_a_verb_of_its_own_waits_for_the_drive_too(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    fast = joint(cell, bus.interface).system.physical_devices["line"].source
    line = cell.physical_devices["line"]
    rise = gpac.Verb(
        "rise",
        blocks={
            "ramp": gpac.library.signal_generator(shape=3, frequency=0.05, offset=1.0),
            "write": gpac.library.write_channel,
        },
        instantiation_parameters={"goal": "write.channel"},
        cells={"y": ["ramp.y", "write.u"]},
        command_lists={"start": [gpac.activate("ramp", every="10 ms"), gpac.activate("write")]},
    )
    bus.enable_input(NODE, False)
    instance = rise.on(fast).asynch(line["x.goal"])
    cell.advance("2 s")
    assert instance.state == "running"
    bus.enable_input(NODE, True)
    before = bus.drives()[0].position
    cell.advance("0.2 s")
    assert bus.drives()[0].drive == "operation enabled"
    # The motion begins when the drive is ready: 0.2 rad/s from its start, not 2 s of that at once.
    assert abs(bus.drives()[0].position - before) <= 0.2 * 0.2 * 1000 + 1


def test_a_reset_says_which_device_is_lost_still_and_why(bus: fake.CanOpenBus, cell: gpac.System) -> None:
    joint(cell, bus.interface).enable()
    bus.power(NODE, False)
    before = lost(cell)
    still = cell.reset()
    assert [*still] == ["line"] and still["line"].startswith("cannot open device 'line' again: ")
    now = str(cell.statistics["physical_devices"]["line"]["lost"])
    assert now != before and still["line"].endswith(now)
    assert any(now in alarm.text for alarm in cell.alarms)
    with pytest.raises(gpac.DeviceFailed, match="cannot open device 'line' again"):
        cell.physical_devices["line"].reopen()
    bus.power(NODE, True)
    assert cell.reset() == {}
