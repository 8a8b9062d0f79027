# SPDX-License-Identifier: Apache-2.0
"""An independent main device, SOEM through pysoem, brings an emulated segment to OP and moves its axes. Runs in a network namespace of
its own, in which it creates a veth pair: `unshare --net python ethercat_soem.py`."""

from __future__ import annotations

import json
import statistics
import struct
import subprocess
import time
from typing import Any

import pysoem

import opengpac as gpac
from opengpac.drivers import fake

OUTPUTS, INPUTS = "<HiihB", "<HiihHb"
POSITION_MODE = 8
DELAY = 0x0928
# Delay of a frame from each drive to the next one, ns.
CABLES = (0, 420, 1300)
# Timeout of a reply, µs: a busy machine is not a fault.
PATIENCE = 10_000_000


def veth() -> None:
    for words in ("link add ec0 type veth peer name ec1", "link set ec0 up", "link set ec1 up"):
        subprocess.run(["ip", *words.split()], check=True)


def exchange(main: Any, control: int, targets: list[int]) -> tuple[int, list[tuple[int, ...]]]:
    for device, target in zip(main.slaves, targets, strict=True):
        device.output = struct.pack(OUTPUTS, control, target, 0, 0, POSITION_MODE)
    main.send_processdata()
    counter = main.receive_processdata(PATIENCE)
    return counter, [struct.unpack(INPUTS, device.input) for device in main.slaves]


def scan(main: Any) -> dict[str, Any]:
    found = main.config_init()
    first = main.slaves[0]
    said: dict[str, Any] = {"found": found, "name": first.name, "identity": [first.man, first.id, first.rev]}
    said["read"] = first.sdo_read(0x1008, 0).decode()
    said["segmented"] = len(first.sdo_read(0x100A, 0, 400))
    text = bytes(range(256)) + bytes(44)
    first.sdo_write(0x2000, 0, text)
    said["written"] = first.sdo_read(0x2000, 0, 400) == text
    try:
        first.sdo_read(0x5555, 0)
    except pysoem.SdoError as error:
        said["abort"] = error.abort_code
    return said


def ours(segment: fake.EtherCatSegment) -> dict[str, Any]:
    """Returns the states and clocks of the drives under our main device."""
    with gpac.System("cell", progress=False) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        axes = {name: {"counts": 1000, "pdos": "device"} for name in ("a", "b", "c")}
        driver = gpac.drivers.ethercat("ec0", axes, sync0="1 ms", timeout="6.5 s", lost_after=30_000)
        line = rtp.physical_device("line", driver, exchange=fast)
        while line.counters["cycles"] < 200:
            pass
        drives = segment.drives()
    return {
        "our_states": [drive.state for drive in drives],
        "our_delays": [drive.clock.delay_ns for drive in drives],
        "our_sync0": [drive.clock.sync0 for drive in drives],
    }


def delays(main: Any) -> list[int]:
    return [int.from_bytes(device._fprd(DELAY, 4), "little") for device in main.slaves]


def operate(main: Any) -> dict[str, Any]:
    said: dict[str, Any] = {"left_delays": delays(main), "bytes": main.config_map(), "clocks": bool(main.config_dc())}
    said["delays"] = delays(main)
    for device in main.slaves:
        device.set_watchdog("processdata", 0)
    main.state_check(pysoem.SAFEOP_STATE, PATIENCE)
    main.state = pysoem.OP_STATE
    main.write_state()
    for _ in range(100):
        main.send_processdata()
        main.receive_processdata(PATIENCE)
        if main.state_check(pysoem.OP_STATE, 50_000) == pysoem.OP_STATE:
            break
    main.read_state()
    said["states"] = [[device.state, device.al_status] for device in main.slaves]
    said["expected"] = main.expected_wkc
    return said


def move(main: Any) -> dict[str, Any]:
    targets = [1000] * len(main.slaves)
    counter, inputs = 0, []
    for control in (0x80, 0x06, 0x07, 0x0F):
        for _ in range(3):
            counter, inputs = exchange(main, control, targets)
    said: dict[str, Any] = {"counter": counter, "enabled": [status & 0x6F for status, *_ in inputs]}
    spans: list[float] = []
    for step in range(1, 1001):
        begun = time.perf_counter()
        counter, inputs = exchange(main, 0x0F, [1000 + step] * len(targets))
        spans.append(time.perf_counter() - begun)
    # The input values lag by one frame.
    _, inputs = exchange(main, 0x0F, [2000] * len(targets))
    said["positions"] = [position for _, position, *_ in inputs]
    _, inputs = exchange(main, 0x0F, [10_000_000] * len(targets))
    _, inputs = exchange(main, 0x0F, [10_000_000] * len(targets))
    said["far"] = [[status & 0x4F, error] for status, _, _, _, error, _ in inputs]
    said["exchange_us"] = statistics.median(spans) * 1e6
    return said


def terminals() -> dict[str, Any]:
    """Reads a coupler with terminals behind it: their mapping comes from EEPROMs and objects; their wires are read and driven."""
    line = (
        {"name": "coupler", "terminal": {}},
        {"name": "inputs", "terminal": {"digital_inputs": 8}},
        {"name": "outputs", "terminal": {"digital_outputs": 16}},
        {"name": "analog", "terminal": {"analog_inputs": 2, "analog_outputs": 1}},
    )
    with fake.ethercat(*line, interface="ec1") as segment:
        main = pysoem.Master()
        main.open("ec0")
        main.config_init()
        said: dict[str, Any] = {"mapped": main.config_map()}
        for device in main.slaves:
            device.set_watchdog("processdata", 0)
        main.state_check(pysoem.SAFEOP_STATE, PATIENCE)
        main.state = pysoem.OP_STATE
        main.write_state()
        _, inputs, outputs, analog = main.slaves
        segment.put(1, 5, 1)
        segment.put(3, 1, -1234)
        for _ in range(100):
            outputs.output, analog.output = bytes([0x81, 0x02]), struct.pack("<h", 4321)
            main.send_processdata()
            said["terminals_counter"] = main.receive_processdata(PATIENCE)
            if main.state_check(pysoem.OP_STATE, 50_000) == pysoem.OP_STATE:
                break
        for _ in range(2):
            main.send_processdata()
            said["terminals_counter"] = main.receive_processdata(PATIENCE)
        main.read_state()
        said["terminals_states"] = [[device.state, device.al_status] for device in main.slaves]
        said["terminals_expected"] = main.expected_wkc
        said["sizes"] = [[len(device.input), len(device.output)] for device in main.slaves]
        said["digital"], said["analog"] = inputs.input[0], struct.unpack("<HhHh", analog.input)
        said["carried"] = [terminal.outputs for terminal in segment.terminals()]
        main.state = pysoem.INIT_STATE
        main.write_state()
        main.close()
    return said


def main() -> None:
    veth()
    drives = ({"name": "drive", "position": 1000, "cable_ns": cable} for cable in CABLES)
    with fake.ethercat(*drives, interface="ec1") as segment:
        said = ours(segment)
        master = pysoem.Master()
        master.open("ec0")
        said = {**said, **scan(master), **operate(master), **move(master)}
        master.state = pysoem.INIT_STATE
        master.write_state()
        master.close()
    print(json.dumps({**said, **terminals()}))


if __name__ == "__main__":
    main()
