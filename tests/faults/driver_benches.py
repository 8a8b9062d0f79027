# SPDX-License-Identifier: Apache-2.0
"""Table of the drivers that a campaign kills: each with its counterpart, the channel that is commanded, and the safe state behind it."""

from __future__ import annotations

import atexit
import contextlib
import json
import secrets
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import axis_benches
import opengpac as gpac
from plant import LINGER, Plant

PATIENT = "10 s"
"""Timeout of a driver's waits for its device: here a kill ends them, never a busy machine."""
FURNACE = Path(__file__).parents[1] / "python" / "drivers" / "furnace.py"
RAIL = Path(__file__).parent / "rail.xml"
HOME = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
"""Pose of the Universal Robots arm, rad."""
SILENT = "1 s"
"""Time without a step after which a plant counts as lost; time without a request after which a server's device does."""


class Bench(ABC):
    """Counterpart in operation, and the driver for it. `BENCHES` has one for each driver."""

    channel: str
    """Channel that the verb commands."""
    value = 1.0
    """Commanded value."""

    @abstractmethod
    def driver(self) -> gpac.drivers.Driver:
        """Returns the driver of the counterpart, here or in another process that received `address`."""

    @abstractmethod
    def commanded(self) -> bool:
        """Returns whether the counterpart has the commanded value."""

    host: str | None = None
    """Process of the device, if the driver itself starts it: an entry of the native module."""

    @staticmethod
    def met(_: gpac.PhysicalDevice) -> bool:
        """Returns whether the driver has met its counterpart, so that it notices its loss."""
        return True

    def safe(self) -> bool | None:
        """Returns whether the outputs are safe; `None` if a killed driver process leaves them unchanged, for the device's own watchdog."""
        return None

    @property
    @abstractmethod
    def address(self) -> str:
        """Address of the counterpart for another process."""

    @abstractmethod
    def close(self) -> None:
        """Ends the counterpart."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Modbus(Bench):
    channel = "speed"

    def __init__(self) -> None:
        self.peer = gpac.drivers.fake.modbus().start()
        self.peer.put("holding", 0, 0.0, "float")

    @property
    def address(self) -> str:
        return self.peer.address

    def driver(self) -> gpac.drivers.Driver:
        return modbus(self.address)

    def commanded(self) -> bool:
        return self.peer.get("holding", 0, "float") == self.value

    def close(self) -> None:
        self.peer.close()


class _Text(Bench):
    channel = "setpoint"

    def __init__(self) -> None:
        self.peer = gpac.drivers.fake.text(answers={"P": "12.5 kg"}).start()

    @property
    def address(self) -> str:
        return self.peer.address

    def driver(self) -> gpac.drivers.Driver:
        return text(self.address)

    def commanded(self) -> bool:
        return any(said.startswith("SP ") and float(said[3:]) == self.value for said in self.peer.heard)

    def close(self) -> None:
        self.peer.close()


class _Servos(Bench):
    channel = "a.goal"
    value = 0.2

    def __init__(self, kind: str) -> None:
        self.kind, self.bus = kind, gpac.drivers.fake.servos(kind, [1, 2])

    @property
    def address(self) -> str:
        return self.bus.port

    def driver(self) -> gpac.drivers.Driver:
        return servos(self.kind, self.address)

    def commanded(self) -> bool:
        return self.bus[1].torque and self.bus[1].goal != 2048

    def safe(self) -> bool:
        return not any(servo.torque for servo in self.bus.servos.values())

    def close(self) -> None:
        self.bus.close()


class _EtherCat(axis_benches.Axis, Bench):
    def __init__(self) -> None:
        super().__init__(gpac.drivers.fake.ethercat("a"))

    def driver(self) -> gpac.drivers.Driver:
        return axis_benches.ethercat(self.address)


class _CanOpen(axis_benches.Axis, Bench):
    def __init__(self) -> None:
        super().__init__(gpac.drivers.fake.canopen("a"))

    def driver(self) -> gpac.drivers.Driver:
        return axis_benches.canopen(self.address)


class _Python(Bench):
    """Bench whose driver process is the counterpart: a furnace that logs its events."""

    channel, host = "heater", "opengpac.driver.process"

    def __init__(self) -> None:
        self.folder = tempfile.mkdtemp(prefix="furnace-")

    @property
    def address(self) -> str:
        return self.folder

    def driver(self) -> gpac.drivers.Driver:
        return python(self.address)

    def commanded(self) -> bool:
        return "open" in self._told()

    def safe(self) -> bool:
        return any(what.startswith("safe ") for what in self._told())

    def _told(self) -> list[str]:
        file = Path(self.address) / "told"
        return file.read_text().split("\n") if file.exists() else []

    def close(self) -> None:
        # The process may still write its last lines.
        atexit.register(shutil.rmtree, self.folder, ignore_errors=True)


class _Mujoco(Bench):
    """Simulated carriage in a process of its own, which outlives its commanders."""

    channel, host = "x.effort", "run_plant"

    def __init__(self) -> None:
        self.plant = Plant(f"campaign-{secrets.token_hex(6)}")

    @property
    def address(self) -> str:
        return self.plant.name

    def driver(self) -> gpac.drivers.Driver:
        return mujoco(self.address)

    def commanded(self) -> bool:
        state = self.plant.state()
        return state is not None and self.plant.speed(state) != 0.0

    def safe(self) -> bool:
        state = self.plant.state()
        return state is not None and state["is_safe"]

    def close(self) -> None:
        pass


class _Ur(Bench):
    """Controller whose own program brings its arm to rest and ends when commands cease; its goals never jump."""

    channel, value = "shoulder_pan.goal", 1.0

    def __init__(self) -> None:
        self.robot = gpac.drivers.fake.ur(HOME, lockstep=False)

    @property
    def address(self) -> str:
        return self.robot.host

    def driver(self) -> gpac.drivers.Driver:
        return ur(self.address)

    def commanded(self) -> bool:
        return abs(self.robot.position[0] - HOME[0]) > 0.01

    def safe(self) -> bool:
        rests = self.robot.program is None and not any(self.robot.do(lambda: self.robot.arm.velocity))
        return rests and self.robot.step_max <= gpac.drivers.fake.LEAP_MAX

    def close(self) -> None:
        self.robot.close()


class _ModbusServer(Bench):
    """Controller of the line that polls the level as soon as a server offers it."""

    channel, value = "level", 2.5

    def __init__(self) -> None:
        # Bound, so that the port is assigned to no one else; a server that allows the reuse of addresses can still listen on it.
        self._held = socket.socket()
        self._held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._held.bind(("127.0.0.1", 0))
        self.port: int = self._held.getsockname()[1]
        self.seen: float | None = None
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        return str(self.port)

    def driver(self) -> gpac.drivers.Driver:
        return modbus_server(self.address)

    @staticmethod
    def met(device: gpac.PhysicalDevice) -> bool:
        return device.counters["requests"] > 0

    def commanded(self) -> bool:
        return self.seen == self.value

    def close(self) -> None:
        self._ends.set()
        self._thread.join()
        self._held.close()

    def _ask(self) -> None:
        while not self._ends.wait(0.005):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), timeout=1.0) as line:
                while not self._ends.wait(0.005):
                    line.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 1, 4, 0, 2))
                    answer = line.recv(64)
                    if len(answer) != 13:
                        break
                    (self.seen,) = struct.unpack(">f", answer[9:])


def modbus(address: str) -> gpac.drivers.Driver:
    """Returns the driver of a device with one register pair."""
    speed = {"holding": 0, "type": "float", "write": True}
    return gpac.drivers.modbus(address, channels={"speed": speed, "seen": {"holding": 0, "type": "float"}}, answer="0.5 s", age_max=PATIENT)


def text(address: str) -> gpac.drivers.Driver:
    """Returns the driver of a scale with a set-point."""
    return gpac.drivers.text(address, reads=["{weight} kg"], writes=["SP {setpoint}"], asks="P", answer="0.5 s", age_max=PATIENT)


def servos(kind: str, address: str) -> gpac.drivers.Driver:
    """Returns the driver of two servos."""
    return getattr(gpac.drivers, kind)(address, {"a": {"id": 1}, "b": {"id": 2}}, latency="0.5 s", age_max=PATIENT, echo=False)


def python(address: str) -> gpac.drivers.Driver:
    """Returns the driver of a furnace in a process of its own."""
    return gpac.drivers.python(FURNACE, folder=address, period="5 ms", age_max=PATIENT)


def mujoco(name: str) -> gpac.drivers.Driver:
    """Returns the driver of a carriage in a process of its own."""
    return gpac.drivers.plant_process(gpac.drivers.mujoco(RAIL), name=name, linger=LINGER, silent=SILENT)


def ur(host: str) -> gpac.drivers.Driver:
    """Returns the driver of a Universal Robots arm."""
    return gpac.drivers.ur(host, silence=PATIENT, timeout="1 s")


def modbus_server(port: str) -> gpac.drivers.Driver:
    """Returns the driver of a server that offers a level."""
    level = {"input": 0, "type": "float", "write": True}
    return gpac.drivers.modbus_server(f"tcp/127.0.0.1:{port}", channels={"level": level}, silent=SILENT, age_max=PATIENT)


BENCHES: dict[str, Callable[[], Bench]] = {
    "modbus": _Modbus,
    "modbus_server": _ModbusServer,
    "text": _Text,
    "feetech": lambda: _Servos("feetech"),
    "dynamixel": lambda: _Servos("dynamixel"),
    "ethercat": _EtherCat,
    "canopen": _CanOpen,
    "python": _Python,
    "mujoco": _Mujoco,
    "ur": _Ur,
}
"""Constructor of the counterpart, for each driver."""

DRIVERS = {
    "modbus": modbus, "text": text, "feetech": lambda address: servos("feetech", address),
    "dynamixel": lambda address: servos("dynamixel", address), "python": python, "ethercat": axis_benches.ethercat,
    "canopen": axis_benches.canopen, "modbus_server": modbus_server, "mujoco": mujoco, "ur": ur,
}  # fmt: skip
"""Constructor of each driver for an address."""

_COUNTERPART = """
import sys
sys.path.insert(0, sys.argv[1])
from driver_benches import BENCHES
with BENCHES[sys.argv[2]]() as bench:
    print(bench.address, flush=True)
    sys.stdin.read()
"""


@contextmanager
def apart(name: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Yields a counterpart in a process of its own, and its address."""
    command = [sys.executable, "-c", _COUNTERPART, str(Path(__file__).parent), name]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate()


def told(name: str, address: str) -> str:
    """Returns the text from which another process can open the counterpart."""
    return json.dumps({"name": name, "address": address})


def kind_of(name: str) -> type[Bench]:
    """Returns the bench class of a driver."""
    made = BENCHES[name]
    return made if isinstance(made, type) else _Servos


def opened(words: str) -> tuple[str, float, gpac.drivers.Driver]:
    """Returns the channel, its value and the driver from the text of `told`."""
    asked: dict[str, Any] = json.loads(words)
    name = asked["name"]
    of = kind_of(name)
    return of.channel, of.value, DRIVERS[name](asked["address"])
