# SPDX-License-Identifier: Apache-2.0
"""An axis on EtherCAT as a joint of a cell. Its time limits are so wide that no machine is too slow for the segment, which is emulated
by a program."""

from __future__ import annotations

from pathlib import Path

import pytest

import opengpac as gpac
from opengpac.cell import AnalogInput, DigitalInput, DigitalOutput, set_output


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
        # 0x1000, the type of a device: a CiA 402 drive.
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
        with pytest.raises(
            gpac.Error, match=r"axis 'gripper' at place 0 is a different device .* axis 'spindle' at place 1: the two are swapped"
        ):
            line.reopen()
        with pytest.raises(gpac.DeviceFailed, match="physical device 'line' is lost"):
            joint.enable()
        assert [drive.drive for drive in segment.drives()] == ["switch on disabled", "switch on disabled"]
        segment.swap(0, 1)
        cell.reset()
        joint.enable()
        gpac.motion.move_absolute(gpac.Group("arm", joint), goal=[0.1])
        assert segment.drives()[0].position == 1000


LINE = (
    {"name": "EK1100", "terminal": {}},
    {"name": "EL1008", "terminal": {"digital_inputs": 8}, "watchdog": False},
    {"name": "EL2008", "terminal": {"digital_outputs": 8}, "watchdog": False},
    {"name": "EL3102", "terminal": {"analog_inputs": 2}, "watchdog": False},
)
# Typical vendor style: several devices and revisions, names in two languages, numbers in two forms, a PDO that is not assigned.
ESI = """<?xml version="1.0"?>
<EtherCATInfo><Vendor><Id>#x00006a1c</Id></Vendor><Descriptions><Devices>
<Device><Type ProductCode="#x80000001" RevisionNo="#x00000001">EL9999</Type></Device>
<Device><Type ProductCode="#x80000008" RevisionNo="1">EL1008</Type>
  <TxPdo Fixed="1" Sm="0"><Index>#x1a00</Index><Name>Old</Name>
    <Entry><Index>#x6000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen><Name>Input</Name><DataType>BOOL</DataType></Entry></TxPdo></Device>
<Device><Type ProductCode="#x80000008" RevisionNo="#x10">EL1008</Type>
  <TxPdo Fixed="1" Sm="0"><Index>#x1a00</Index><Name LcId="1031">Kanal 1</Name><Name LcId="1033">Gate</Name>
    <Entry><Index>#x6000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen><Name>Input</Name><DataType>BOOL</DataType></Entry></TxPdo>
  <TxPdo Sm="0"><Index>6657</Index><Name>Gap</Name><Entry><Index>#x0</Index><BitLen>7</BitLen></Entry></TxPdo>
  <TxPdo><Index>#x1a10</Index><Name>Spare</Name>
    <Entry><Index>#x6100</Index><SubIndex>1</SubIndex><BitLen>8</BitLen><DataType>USINT</DataType></Entry></TxPdo></Device>
</Devices></Descriptions></EtherCATInfo>
"""


def test_terminals_are_channels_that_blocks_of_devices_take() -> None:
    with gpac.drivers.fake.ethercat(*LINE) as segment, gpac.System("cell", clock="virtual", progress=False) as cell:
        fast = cell.processor("rtp0").timer("fast", period="10 ms", priority=80)
        terminals = {
            "in": {"at": 1},
            "out": {"at": 2, "channels": {"lamp": "Channel 3", "valve": {"entry": "channel_8", "safe": True}}},
            "analog": {"at": 3, "channels": {"force": {"entry": "AI Standard Channel 2.Value", "scale": 0.5, "unit": "N"}}},
        }
        driver = gpac.drivers.ethercat(segment.interface, terminals=terminals)
        line = fast.processor.physical_device("line", driver, exchange=fast)
        door = DigitalInput("door", line["in.channel_2"]).enable()
        lamp = DigitalOutput("lamp", line["out.lamp"]).enable()
        force = AnalogInput("force", line["analog.force"]).enable()
        segment.put(1, 1, 1)
        segment.put(3, 1, 250)
        set_output(lamp, True)
        cell.advance("50 ms")
        assert door.value.value is True
        assert force.value.value == 125.0
        assert [terminal.outputs for terminal in segment.terminals()] == [[], [], [0, 0, 1, 0, 0, 0, 0, 1], []]
        cell.emergency_stop("a test")
        cell.advance("50 ms")
        assert segment.terminals()[2].outputs == [0, 0, 0, 0, 0, 0, 0, 1], "safe: off, and the valve on"


def test_an_esi_file_names_the_entries_of_a_terminal(tmp_path: Path) -> None:
    file = tmp_path / "vendor.xml"
    file.write_text(ESI)
    with gpac.drivers.fake.ethercat(*LINE) as segment, gpac.System("cell", clock="virtual", progress=False) as cell:
        fast = cell.processor("rtp0").timer("fast", period="10 ms", priority=80)
        driver = gpac.drivers.ethercat(segment.interface, terminals={"in": {"at": 1, "esi": file, "type": "EL1008"}})
        line = fast.processor.physical_device("line", driver, exchange=fast)
        gate = DigitalInput("gate", line["in.gate"]).enable()
        segment.put(1, 0, 1)
        cell.advance("50 ms")
        assert gate.value.value is True
        driver = gpac.drivers.ethercat(segment.interface, terminals={"in": {"at": 3, "esi": file, "type": "EL1008"}})
        with pytest.raises(gpac.DeviceFailed, match=r"terminal 'in' at place 3 .* product"):
            fast.processor.physical_device("wrong", driver, exchange=fast)


@pytest.mark.parametrize(
    ("text", "wanted", "said"),
    [
        (ESI, {}, r"terminal 'in': 'vendor.xml' describes several subdevices: EL1008, EL9999; select one with type= or product="),
        (ESI, {"type": "EL1009"}, r"does not describe it; its subdevices are EL1008, EL9999; select"),
        (ESI, {"type": "EL9999"}, r"lists no process data for 'EL9999'"),
        (ESI, {"type": "EL1008", "revision": 7}, r"does not describe it"),
        (ESI.replace("#x6000", "#xGG"), {"type": "EL1008"}, r"'vendor.xml' has '#xGG' where a number is expected"),
        (ESI[:200], {}, r"'vendor.xml' is not an ESI file"),
        ("<robot/>", {}, r"is not an ESI file: it begins with <robot>"),
        ("<EtherCATInfo>" + "<a>" * 1000 + "</a>" * 1000 + "</EtherCATInfo>", {}, r"nests its elements more than \d+ levels deep"),
        (ESI.replace("Input", "\x00"), {}, r"is not an ESI file"),
    ],
)
def test_what_is_wrong_with_an_esi_file_is_said(tmp_path: Path, text: str, wanted: dict[str, object], said: str) -> None:
    file = tmp_path / "vendor.xml"
    file.write_text(text)
    with pytest.raises(gpac.CallError, match=said):
        gpac.drivers.ethercat("eth1", terminals={"in": {"at": 1, "esi": file, **wanted}})
    with pytest.raises(gpac.CallError, match=r"terminal 'in': cannot read '.*none.xml': no such file"):
        gpac.drivers.ethercat("eth1", terminals={"in": {"at": 1, "esi": tmp_path / "none.xml"}})
