# SPDX-License-Identifier: Apache-2.0
"""The first process of a Linux with vcan: our driver and a drive on the package `canopen`, on one bus.

Its argument is a folder, into which it writes its results as `said.json`; with `try` as a second argument it only creates the bus.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

LIBC = ctypes.CDLL(None, use_errno=True)
FINIT_MODULE = 313
POWER_OFF = 0x4321FEDC
NODE = 5


def checked(returned: int, what: str) -> None:
    if returned != 0:
        raise OSError(ctypes.get_errno(), what)


def prepare() -> None:
    """Mounts the kernel's folders, loads the CAN modules, and creates a virtual bus."""
    for kind, place in [("proc", "/proc"), ("sysfs", "/sys"), ("tmpfs", "/run"), ("tmpfs", "/dev/shm")]:
        Path(place).mkdir(exist_ok=True)
        checked(LIBC.mount(kind.encode(), place.encode(), kind.encode(), 0, None), f"mount {place}")
    modules = Path("/usr/lib/uml/modules") / os.uname().release / "kernel"
    for module in ["net/can/can", "net/can/can-raw", "net/can/can-bcm", "drivers/net/can/dev/can-dev", "drivers/net/can/vcan"]:
        with open(modules / f"{module}.ko", "rb") as file:
            checked(LIBC.syscall(FINIT_MODULE, file.fileno(), b"", 0), module)
    for line in ["link set lo up", "link add dev vcan0 type vcan", "link set vcan0 up"]:
        subprocess.run(["ip", *line.split()], check=True)


def until(what: str, holds: Callable[[], bool]) -> None:
    """Waits for a condition."""
    end = time.monotonic() + 120
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.01)


def drive(said: dict[str, Any]) -> None:
    """Drives the peer with our driver."""
    from canopen_peer import Peer

    import opengpac as gpac

    peer = Peer("vcan0", NODE)
    axis = {"node": NODE, "counts": 1000, "speed_max": 5.0, "range": [-10, 10], "operating_within_s": 60.0}
    said["found"] = [found["what"] for found in gpac.drivers.scan("canopen", interface="vcan0")]
    with gpac.System("cell", progress=False) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="20 ms", priority=80)
        driver = gpac.drivers.canopen("vcan0", {"x": axis}, cycle="20 ms", timeout="60 s", heartbeat="60 s", lost_after=3000)
        line = rtp.physical_device("line", driver, exchange=fast)
        joint = gpac.robots.Joint("j", drive=line["x"], on=fast, verb=gpac.robots.joint_follower, max_following_error=100.0)
        said["configured"] = [peer.node.sdo[0x1006].raw, peer.node.sdo[0x1016][1].raw, peer.node.sdo[0x1017].raw, peer.node.sdo[0x6060].raw]
        said["period"] = [peer.node.sdo[0x60C2][1].raw, peer.node.sdo[0x60C2][2].raw]
        said["start"] = [peer.value["position"].raw, peer.state]
        joint.enable()
        gpac.motion.move_absolute(gpac.Group("arm", joint), goal=[1.5])
        until("it is where it is to be", lambda: peer.value["position"].raw == 1500)
        said["moved"] = [joint.sensed.value, peer.value["position"].raw, peer.state]
        said["type"] = line.services.read_object(axis="x", index=0x1000)["number"]
        said["name"] = line.services.read_object(axis="x", index=0x1008)["text"]
        line.services.write_object(axis="x", index=0x6071, value=-3, bits=16)
        said["written"] = peer.node.sdo[0x6071].raw
        said["heard"] = peer.heard
        said["counters"] = dict(line.counters)
        lost = lambda: str(cell.statistics["physical_devices"]["line"]["lost"])  # noqa: E731
        peer.fail(0x7121)
        until("the fault is told", lambda: lost() != "None")
        said["fault"] = lost()
        cell.reset()
        joint.enable()
        until("it is in operation", lambda: peer.state == 0x37)
        said["recovered"] = [joint.sensed.value, peer.state]
        peer.restart()
        until("the restart is told", lambda: lost() != "None")
        said["restarted"] = lost()
        cell.reset()
        until("it is started", lambda: peer.syncs > 10)
        before = peer.state
        joint.enable()
        until("it is in operation", lambda: peer.state == 0x37)
        said["joined"] = [joint.sensed.value, before, peer.state]
        joint.disable()
        line.services.home(axis="x", method=35, speed=2.0, position=-0.5)
        said["home"] = [peer.value["position"].raw, peer.node.sdo[0x6098].raw, peer.node.sdo[0x6099][1].raw]
        until("the mode is the axis's again", lambda: peer.value["mode"].raw == 8)
        joint.enable()
        gpac.motion.move_absolute(gpac.Group("arm", joint), goal=[-0.4])
        until("it is where it is to be", lambda: peer.value["position"].raw == -400)
        said["moved_from_home"] = [joint.sensed.value, peer.state]
    peer.close()


def brake(said: dict[str, Any]) -> None:
    """Drives the output of the peer's brake with our driver."""
    from canopen_peer import Peer

    import opengpac as gpac

    peer = Peer("vcan0", NODE)
    axis = {"node": NODE, "counts": 1000, "brake": {"release_ns": 20_000_000, "close_ns": 20_000_000}, "operating_within_s": 60.0}
    with gpac.System("hoist", progress=False) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="20 ms", priority=80)
        driver = gpac.drivers.canopen("vcan0", {"x": axis}, cycle="20 ms", timeout="60 s", heartbeat="60 s", lost_after=3000)
        line = rtp.physical_device("line", driver, exchange=fast)
        joint = gpac.robots.Joint("j", drive=line["x"], on=fast, verb=gpac.robots.joint_follower, max_following_error=100.0)
        output = peer.node.sdo[0x60FE]
        said["brake_closed"] = [output[1].raw, output[2].raw, peer.node.sdo[0x605A].raw]
        joint.enable()
        until("it is released", lambda: output[1].raw == 0)
        said["brake_released"] = peer.state
        cell.emergency_stop("tried")
        until("it is off", lambda: peer.state == 0x50)
        said["brake_stopped"] = output[1].raw
        with contextlib.suppress(gpac.EmergencyStopped):
            said["homed_while_stopped"] = line.services.home(axis="x", method=35)
        cell.reset()
        joint.enable()
        until("it is released again", lambda: output[1].raw == 0)
        said["brake_again"] = peer.state
    # The end of the system brings its devices to their safe state, too.
    until("it is closed", lambda: output[1].raw == 1)
    said["brake_ended"] = peer.value["control"].raw
    peer.close()


def module(said: dict[str, Any]) -> None:
    """Drives an I/O module with our driver."""
    from canopen_peer import Module

    import opengpac as gpac
    from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput, set_output

    peer = Module("vcan0", 7)
    peer.put(0x6000, 2, 0x08)
    peer.put(0x6401, 2, -1500)
    channels = {
        "door": {"input": 11}, "lamp": {"output": 9, "safe": True}, "level": {"analog_input": 1, "scale": 0.001, "unit": "m"},
        "valve": {"analog_output": 0, "scale": 0.01, "unit": "V", "safe": 1.0},
    }  # fmt: skip
    with gpac.System("terminals", progress=False) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="20 ms", priority=80)
        io = {"io": {"node": 7, "channels": channels}}
        driver = gpac.drivers.canopen("vcan0", modules=io, cycle="20 ms", timeout="60 s", heartbeat="60 s", lost_after=3000)
        line = rtp.physical_device("line", driver, exchange=fast)
        until("safe values", lambda: peer.at(0x6200, 2) == 0x02 and peer.at(0x6411, 1) == 100)
        said["module_told"] = [peer.at(0x6206, 2), peer.at(0x6207, 2), peer.at(0x6443, 1), peer.at(0x6444, 1), peer.at(0x1029, 1)]
        door, level = DigitalInput("door", line["io.door"]).enable(), AnalogInput("level", line["io.level"]).enable()
        lamp, valve = DigitalOutput("lamp", line["io.lamp"]).enable(), AnalogOutput("valve", line["io.valve"], low=0, high=10).enable()
        until("inputs", lambda: door.value.value and level.value.value == -1.5)
        said["module_inputs"] = [bool(door.value.value), level.value.value]
        set_output(lamp, False)
        set_output(valve, 2.5)
        until("outputs", lambda: peer.at(0x6200, 2) == 0 and peer.at(0x6411, 1) == 250)
        said["module_outputs"] = [peer.at(0x6200, 2), peer.at(0x6411, 1), dict(line.counters)["frames_refused"]]
    peer.close()


def main() -> None:
    folder = Path(sys.argv[1])
    sys.path.insert(0, str(Path(__file__).parent))
    said: dict[str, Any] = {}
    try:
        prepare()
        if sys.argv[2:] != ["try"]:
            drive(said)
            brake(said)
            module(said)
    except BaseException:
        said["failed"] = traceback.format_exc()
    (folder / "said.json").write_text(json.dumps(said))
    os.sync()
    LIBC.reboot(POWER_OFF)


if __name__ == "__main__":
    main()
