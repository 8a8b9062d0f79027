# SPDX-License-Identifier: Apache-2.0
"""A bus of CANopen that is only a program."""

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
    """Its number on the bus."""
    state: str
    """`operational`, `pre-operational`, `stopped`, `off`."""
    drive: str
    """The state of its axis: `operation enabled`, `fault`."""
    position: int
    """Where its axis is, counts."""
    target: int
    """Where its axis is to be, counts."""
    mode: int
    """6 homing, 8 position, 9 velocity, 10 torque."""
    error: int
    """Its error code, 0x603F; 0 where it has none."""


@dataclass(frozen=True)
class CanOpenModule:
    """State of an emulated module of inputs and outputs. Its terminals are counted from 0."""

    node: int
    """Its number on the bus."""
    state: str
    """`operational`, `pre-operational`, `stopped`, `off`."""
    inputs: list[bool]
    """Digital inputs, in bytes of 8."""
    outputs: list[bool]
    """Digital outputs, in bytes of 8."""
    analog_inputs: list[int]
    """Counts, -32768 to 32767."""
    analog_outputs: list[int]
    """Counts, -32768 to 32767."""


class CanOpenBus(EmulatedBus):
    """Emulated drives and modules on a bus, in a process of their own; `canopen()` starts one. It ends with `close()`, a `with`, or its
    program."""

    interface: str
    """What a controller opens: `local:NAME`."""

    def __init__(self, nodes: list[dict[str, Any]]) -> None:
        self.interface = f"local:{secrets.token_hex(8)}"
        super().__init__("run_canopen_bus", "the emulated bus", {"interface": self.interface, "nodes": nodes})

    def drives(self) -> list[CanOpenDrive]:
        """Returns the present state of each drive, in their order."""
        return [CanOpenDrive(**drive) for drive in self._shown()["drives"]]

    def modules(self) -> list[CanOpenModule]:
        """Returns the present state of each module, in their order."""
        digital = ("inputs", "outputs")
        shown = self._shown()["modules"]
        return [CanOpenModule(**{**module, **{name: [bool(bit) for bit in module[name]] for name in digital}}) for module in shown]

    @property
    def frames(self) -> int:
        """Frames that have come from controllers."""
        return self._shown()["frames"]

    def put(self, node: int, terminal: Terminal, number: int, value: float) -> None:
        """Puts something on a terminal of a module: True or False on a digital one, counts on an analog one; `number` is from 0."""
        self._say({"do": "put", "node": node, "terminal": terminal, "number": number, "value": int(value)})

    def power(self, node: int, on: bool) -> None:
        """Switches the voltage of a drive. With it comes a drive that knows nothing, its axis where it was."""
        self._say({"do": "power", "node": node, "on": on})

    def fail(self, node: int, error: int = 0x7121) -> None:
        """Makes a drive find something wrong: an error code of CiA 402, here that its motor is blocked. It sends an emergency."""
        self._say({"do": "fail", "node": node, "error": error})

    def enable_input(self, node: int, closed: bool) -> None:
        """Closes or opens the enable input of a drive; while it is open, the drive stays in "switch on disabled"."""
        self._say({"do": "enable_input", "node": node, "closed": closed})

    def bus_off(self) -> None:
        """Makes the adapter of the controller report that it has left the bus."""
        self._say({"do": "bus_off"})


@taking
def canopen(*nodes: str | Mapping[str, Any]) -> CanOpenBus:
    """An emulated bus: drives by CiA 402 with motors that follow, and modules by CiA 401, as `gpac.drivers.canopen` sees them.

    A drive is its name, with the nodes 1, 2, … in their order, or `{"name": "x", "node": 5, "position": 1000, "watchdog": False}`: where
    it stands at the start in counts, and whether it watches for its controller; `limits`, where the switches at the ends of its machine
    are in counts; `falls`, that it has a brake, and a load that falls so fast where nothing holds it, counts/s; `serial` (else its node),
    by which it is identified. With `module` it is a module of inputs and outputs: `{"name": "io", "node": 7, "module": {"inputs": 16,
    "outputs": 8, "analog_inputs": 4}}`. Its time is that of the source that exchanges with it, so that a program under the virtual clock
    has the same values each time.
    """
    if not nodes:
        refuse(CallError, "a bus has no drive", 'name them: gpac.drivers.fake.canopen("x", "y")')
    named = [{"name": node, "node": at} if isinstance(node, str) else {"node": at, **node} for at, node in enumerate(nodes, 1)]
    return CanOpenBus(named)
