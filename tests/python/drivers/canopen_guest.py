# SPDX-License-Identifier: Apache-2.0
"""The first process of a Linux with vcan: our driver and a drive on the package `canopen`, on one bus.

Its argument is a folder, in which it says in `said.json` what came of it; with `try` behind it, only the bus is made."""

from __future__ import annotations

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
    """Folders of the kernel, the modules of CAN, and a virtual bus."""
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
    """What our driver does with the peer."""
    from canopen_peer import Peer

    import opengpac as gpac

    peer = Peer("vcan0", NODE)
    axis = {"node": NODE, "counts": 1000, "speed_max": 5.0, "range": [-10, 10]}
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
    peer.close()


def main() -> None:
    folder = Path(sys.argv[1])
    sys.path.insert(0, str(Path(__file__).parent))
    said: dict[str, Any] = {}
    try:
        prepare()
        if sys.argv[2:] != ["try"]:
            drive(said)
    except BaseException:
        said["failed"] = traceback.format_exc()
    (folder / "said.json").write_text(json.dumps(said))
    os.sync()
    LIBC.reboot(POWER_OFF)


if __name__ == "__main__":
    main()
