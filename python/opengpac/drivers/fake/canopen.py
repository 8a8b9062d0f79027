# SPDX-License-Identifier: Apache-2.0
"""Emulated CANopen bus, in software only."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ...errors import CallError, refuse
from ...refusals.argument_types import taking
from .emulated import EmulatedBus

Terminal = Literal["input", "output", "analog_input", "analog_output"]


@dataclass(frozen=True)
class CanOpenDrive:
    """State of an emulated drive."""

    node: int
    """Node ID."""
    state: str
    """State of the node: `operational`, `pre-operational`, `stopped` or `off`."""
    drive: str
    """State of the axis, for example `operation enabled` or `fault`."""
    position: int
    """Position of the axis, counts."""
    target: int
    """Target of the axis, counts."""
    mode: int
    """Mode: 6 homing, 8 position, 9 velocity, 10 torque."""
    error: int
    """Error code, 0x603F; 0 if none."""


@dataclass(frozen=True)
class CanOpenModule:
    """State of an emulated input and output module. Its terminals are numbered from 0."""

    node: int
    """Node ID."""
    state: str
    """State of the node: `operational`, `pre-operational`, `stopped` or `off`."""
    inputs: list[bool]
    """Digital inputs, padded to whole bytes."""
    outputs: list[bool]
    """Digital outputs, padded to whole bytes."""
    analog_inputs: list[int]
    """Analog inputs in counts, -32768 to 32767."""
    analog_outputs: list[int]
    """Analog outputs in counts, -32768 to 32767."""


class CanOpenBus(EmulatedBus):
    """Emulated drives and modules on a bus, in a separate process; `canopen()` starts one. The process ends on `close()`, at the end of
    a `with` block, or when the program exits."""

    interface: str
    """Interface for the controller: `local:NAME`."""

    def __init__(self, nodes: list[dict[str, Any]]) -> None:
        self.interface = f"local:{secrets.token_hex(8)}"
        super().__init__("run_canopen_bus", "the emulated bus", {"interface": self.interface, "nodes": nodes})

    def drives(self) -> list[CanOpenDrive]:
        """Returns the current state of each drive, in order."""
        return [CanOpenDrive(**drive) for drive in self._shown()["drives"]]

    def modules(self) -> list[CanOpenModule]:
        """Returns the current state of each module, in order."""
        digital = ("inputs", "outputs")
        shown = self._shown()["modules"]
        return [CanOpenModule(**{**module, **{name: [bool(bit) for bit in module[name]] for name in digital}}) for module in shown]

    @property
    def frames(self) -> int:
        """Number of frames received from controllers."""
        return self._shown()["frames"]

    def put(self, node: int, terminal: Terminal, number: int, value: float) -> None:
        """Sets an input terminal of a module: True or False for a digital one, counts for an analog one; `number` starts at 0."""
        self._say({"do": "put", "node": node, "terminal": terminal, "number": number, "value": int(value)})

    def power(self, node: int, on: bool) -> None:
        """Switches the power supply of a drive. On power-up the drive is reset, but its axis keeps its position."""
        self._say({"do": "power", "node": node, "on": on})

    def fail(self, node: int, error: int = 0x7121) -> None:
        """Makes a drive report a CiA 402 error, by default a blocked motor. The drive sends an emergency message."""
        self._say({"do": "fail", "node": node, "error": error})

    def enable_input(self, node: int, closed: bool) -> None:
        """Closes or opens the enable input of a drive; while it is open, the drive stays in "switch on disabled"."""
        self._say({"do": "enable_input", "node": node, "closed": closed})

    def bus_off(self) -> None:
        """Makes the controller's CAN adapter report bus-off."""
        self._say({"do": "bus_off"})


@taking
def canopen(*nodes: str | Mapping[str, Any]) -> CanOpenBus:
    """Starts an emulated bus for `gpac.drivers.canopen`, with CiA 402 drives whose motors follow their targets, and CiA 401 modules.

    Each entry of `nodes` is either the name of a drive, whose node ID is its position in the list (1, 2, …), or a dictionary such as
    `{"name": "x", "node": 5, "position": 1000, "watchdog": False}`. `position`: initial position, counts. `watchdog`: whether the
    drive monitors its controller. `limits`: positions of the machine's limit switches, counts. `falls`: for a drive with a brake, the
    speed at which its load drops when nothing holds it, counts/s. `serial`: serial number (default: the node ID). An entry with
    `module` is an I/O module: `{"name": "io", "node": 7, "module": {"inputs": 16, "outputs": 8, "analog_inputs": 4}}`. The bus takes
    its time from the source that exchanges with it, so a program under the virtual clock is reproducible.
    """
    if not nodes:
        refuse(CallError, "a bus needs at least one drive", 'name the drives: gpac.drivers.fake.canopen("x", "y")')
    named = [{"name": node, "node": at} if isinstance(node, str) else {"node": at, **node} for at, node in enumerate(nodes, 1)]
    return CanOpenBus(named)
