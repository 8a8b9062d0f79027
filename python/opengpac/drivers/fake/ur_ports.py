# SPDX-License-Identifier: Apache-2.0
"""Ports of an emulated controller, and the connected clients."""

from __future__ import annotations

import contextlib
import socket
import struct
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar, Protocol

from .rtde import message, packed, types_of, unpacked

RTDE, DASHBOARD, SCRIPTS = (30004,), (29999,), (30001, 30002, 30003)

_VERSION = (5, 12, 0, 1101319)


class Controller(Protocol):
    """Functions of the controller that its ports use."""

    safety: int
    mode: int
    runtime: int
    cycles: int
    is_remote: bool

    @property
    def peers(self) -> Sequence[Peer]:
        """All connected clients."""
        ...

    def unlock(self) -> None: ...

    def switch_on(self) -> None: ...

    def end_program(self) -> None: ...

    def begin_program(self, text: str) -> None: ...

    def send_packages(self, to: Peer | None = None) -> None: ...

    def take(self, values: dict[str, Any]) -> None: ...


class Peer:
    """A client's connection."""

    def __init__(self, robot: Controller, connection: socket.socket) -> None:
        self.robot, self.socket = robot, connection
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._buffer = b""

    def receive(self) -> bool:
        """Handles received data; returns False if the connection was closed."""
        try:
            more = self.socket.recv(1 << 16)
        except BlockingIOError:
            return True
        except OSError:
            more = b""
        if not more:
            self.gone()
            return False
        self._buffer += more
        self.taken()
        return True

    def taken(self) -> None:
        """Handles new data in the receive buffer."""

    def gone(self) -> None:
        """Handles a disconnect by the peer."""

    def send(self, contents: bytes) -> None:
        """Sends as much as the connection accepts. A client that does not read loses packages, as with a real controller."""
        with contextlib.suppress(OSError):
            self.socket.sendall(contents)


class Rtde(Peer):
    """An RTDE client."""

    def __init__(self, robot: Controller, connection: socket.socket) -> None:
        super().__init__(robot, connection)
        self._outputs: list[str] = []
        self._inputs: dict[int, list[str]] = {}
        self._every = 1
        self._runs = False

    @property
    def asks_pose(self) -> bool:
        """True if the client requests the tool pose, which must then be computed."""
        return any("TCP_pose" in name for name in self._outputs)

    def send_package(self, values: dict[str, Any]) -> None:
        """Sends the requested values if the client has started and a package is due."""
        if self._runs and self.robot.cycles % self._every == 0:
            self.send(message("U", b"\x01" + packed(self._outputs, values)))

    def taken(self) -> None:
        while len(self._buffer) >= 3:
            size, kind = struct.unpack(">HB", self._buffer[:3])
            if size < 3 or len(self._buffer) < size:
                return
            contents, self._buffer = self._buffer[3:size], self._buffer[size:]
            self._answer(chr(kind), contents)

    def _answer(self, kind: str, contents: bytes) -> None:
        if kind == "V":
            self.send(message("V", bytes([contents == b"\0\x02"])))
        elif kind == "v":
            self.send(message("v", struct.pack(">4I", *_VERSION)))
        elif kind == "O":
            (frequency,) = struct.unpack(">d", contents[:8])
            self._outputs = _names(contents[8:])
            self._every = max(1, round(500 / frequency)) if frequency > 0 else 1
            self.send(message("O", b"\x01" + ",".join(types_of(self._outputs)).encode()))
        elif kind == "I":
            names, number = _names(contents), len(self._inputs) + 1
            used = {name for peer in self._others() for recipe in peer._inputs.values() for name in recipe}
            kinds = ["IN_USE" if name in used else kind for name, kind in zip(names, types_of(names), strict=True)]
            if "IN_USE" not in kinds and "NOT_FOUND" not in kinds:
                self._inputs[number] = names
            self.send(message("I", bytes([number]) + ",".join(kinds).encode()))
        elif kind in "SP":
            self._runs = kind == "S"
            self.send(message(kind, b"\x01"))
            if self._runs:
                self.robot.send_packages(self)
        elif kind == "U" and contents and contents[0] in self._inputs:
            try:
                values = unpacked(self._inputs[contents[0]], contents[1:])
            except struct.error:
                return
            self.robot.take(values)

    def _others(self) -> Iterable[Rtde]:
        return (peer for peer in self.robot.peers if isinstance(peer, Rtde) and peer is not self)


def _names(contents: bytes) -> list[str]:
    """Returns the requested names. Tolerates a trailing comma, which one widely used client sends."""
    return [name for name in contents.decode(errors="replace").split(",") if name]


class Dashboard(Peer):
    """A dashboard client."""

    _MODES: ClassVar = {3: "POWER_OFF", 5: "IDLE", 7: "RUNNING"}
    _SAFETY: ClassVar = {1: "NORMAL", 3: "PROTECTIVE_STOP", 7: "ROBOT_EMERGENCY_STOP"}

    def __init__(self, robot: Controller, connection: socket.socket) -> None:
        super().__init__(robot, connection)
        self.send(b"Connected: Universal Robots Dashboard Server\n")

    def taken(self) -> None:
        while b"\n" in self._buffer:
            line, self._buffer = self._buffer.split(b"\n", 1)
            self.send(self._answer(line.decode(errors="replace").strip()).encode() + b"\n")

    def _answer(self, asked: str) -> str:
        robot = self.robot
        runs = str(robot.runtime == 2).lower()
        match asked.lower():
            case "robotmode":
                return f"Robotmode: {self._MODES.get(robot.mode, 'NO_CONTROLLER')}"
            case "safetystatus":
                return f"Safetystatus: {self._SAFETY.get(robot.safety, 'FAULT')}"
            case "is in remote control":
                return str(robot.is_remote).lower()
            case "running":
                return f"Program running: {runs}"
            case "polyscopeversion":
                return "URSoftware 5.12.0.1101319 (Feb 15 2022)"
            case "get robot model":
                return "UR5"
            case "get serial number":
                return "20215500001"
            case "close popup" | "close safety popup":
                return "closing popup"
            case "quit":
                return "Disconnected"
            case "programstate":
                return "STOPPED <unnamed>" if runs == "false" else "PLAYING opengpac"
        return self._done(asked.lower()) if robot.is_remote else "Command is not allowed due to local control"

    def _done(self, asked: str) -> str:
        robot = self.robot
        match asked:
            case "unlock protective stop":
                if robot.safety != 3:
                    return "Cannot unlock protective stop: there is none"
                robot.unlock()
                return "Protective stop releasing"
            case "power on" | "brake release":
                robot.switch_on()
                return "Powering on" if asked == "power on" else "Brake releasing"
            case "power off":
                robot.end_program()
                robot.mode = 3
                return "Powering off"
            case "restart safety":
                robot.unlock()
                robot.mode = 3
                return "Restarting safety"
            case "stop":
                robot.end_program()
                return "Stopped"
            case "play":
                return "Failed to execute: play"
        return f'could not understand: "{asked}"'


class Scripts(Peer):
    """A client that sends programs. A program ends with a line `end` that is not indented."""

    def taken(self) -> None:
        text = self._buffer.decode(errors="replace").replace("\r", "")
        end = text.rfind("\nend\n")
        if end >= 0:
            self._buffer = text[end + 5 :].encode()
            self.robot.begin_program(text[: end + 5])
