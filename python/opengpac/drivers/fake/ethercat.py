# SPDX-License-Identifier: Apache-2.0
"""Emulated EtherCAT segment, in software only."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...errors import CallError, refuse
from ...refusals.argument_types import taking
from .emulated import EmulatedBus


@dataclass(frozen=True)
class Clock:
    """Distributed clock of an emulated drive."""

    delay_ns: int
    """Propagation delay of a frame from the reference clock, as written by a main device."""
    difference_ns: int
    """Time difference from the reference clock."""
    sync0: int
    """Number of SYNC0 events in OP."""
    missed: int
    """Number of SYNC0 events without new outputs."""
    margin_ns_min: int
    """Minimum time from new outputs to SYNC0."""
    margin_ns_max: int
    """Maximum time from new outputs to SYNC0."""


@dataclass(frozen=True)
class Drive:
    """State of an emulated drive."""

    state: str
    """EtherCAT state of the drive, with its error: `OP`, `SAFEOP with error 0x001b, …`."""
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
    clock: Clock
    """Distributed clock of the drive."""


@dataclass(frozen=True)
class Terminal:
    """State of an emulated terminal on the line."""

    position: int
    """Position on the line."""
    state: str
    """EtherCAT state of the terminal, with its error."""
    outputs: list[int]
    """Values of the outputs: 0 or 1 for digital ones, counts for analog ones."""


class EtherCatSegment(EmulatedBus):
    """Emulated drives and terminals on a line, in a separate process.

    Started by `ethercat()`. The process ends on `close()`, at the end of a `with` block, or when the program exits.
    """

    interface: str
    """Interface for the main device: a network interface, or `local:NAME`."""

    def __init__(self, options: Mapping[str, Any], interface: str) -> None:
        self.interface = interface
        super().__init__("run_ethercat_segment", "the emulated segment", options)

    def drives(self) -> list[Drive]:
        """Returns the current state of each drive, in order."""
        return [Drive(**{**drive, "clock": Clock(**drive["clock"])}) for drive in self._shown()["drives"]]

    def terminals(self) -> list[Terminal]:
        """Returns the current state of each terminal, in order of position."""
        return [Terminal(**terminal) for terminal in self._shown()["terminals"]]

    def put(self, position: int, input: int, value: float) -> None:
        """Sets an `input`, counted from 0, of the terminal at `position` to `value`: 0 or 1 for a digital input, counts for an analog
        one."""
        self._say({"do": "put", "position": position, "input": input, "value": int(value)})

    def counts(self) -> dict[str, int]:
        """Numbers of frames received, malformed, intentionally dropped, and intentionally corrupted."""
        return self._shown()["counts"]

    def cut(self, position: int = 0) -> None:
        """Disconnects the cable to the drive at `position`."""
        self._say({"do": "cut", "position": position})

    def heal(self) -> None:
        """Reconnects the cable."""
        self._say({"do": "heal"})

    def power(self, position: int, on: bool) -> None:
        """Switches the power supply of a drive. On power-up the drive is reset, but its axis keeps its position."""
        self._say({"do": "power", "position": position, "on": on})

    def swap(self, position: int, other: int) -> None:
        """Swaps two drives on the line, like a cabling error. Both are without power during the swap."""
        self._say({"do": "swap", "position": position, "other": other})

    def fail(self, position: int, error: int = 0x7121) -> None:
        """Makes a drive report a CiA 402 error, by default a blocked motor."""
        self._say({"do": "fail", "position": position, "error": error})

    def enable_input(self, position: int, closed: bool) -> None:
        """Closes or opens the enable input of a drive; while it is open, the drive stays in "switch on disabled"."""
        self._say({"do": "enable_input", "position": position, "closed": closed})


@taking
def ethercat(*drives: str | Mapping[str, Any], interface: str | None = None) -> EtherCatSegment:
    """Starts an emulated segment for any main device, with terminals, and with CiA 402 drives whose motors follow their targets.

    Each of `drives` is a name, or `{"name": "x", "position": 1000, "watchdog": False}`: its initial position in counts, and whether
    it has an output watchdog; `clock_ppm`, the rate error of its clock (positive: fast); `cable_ns`, the propagation delay from the
    previous drive; `limits`, the positions of its machine's limit switches in counts; `falls`, for a drive with a brake, the speed at
    which its load falls if nothing holds it, counts/s; `serial` (by default its position, from 1) and `alias`, the identity of the
    drive. With `terminal` it is a terminal, `{"name": "io", "terminal": {"digital_inputs": 8}}`: `digital_inputs` and
    `digital_outputs`, or `analog_inputs` and `analog_outputs` of 16 bits; `{}` is a coupler. Without `interface` the segment answers
    on a local socket, which needs no privileges; with the name of a network interface it answers there, such as one end of a veth
    pair, which needs CAP_NET_RAW.
    """
    if not drives:
        refuse(CallError, "a segment needs at least one drive", 'name the drives: gpac.drivers.fake.ethercat("x", "y")')
    at = interface if interface is not None else f"local:{secrets.token_hex(8)}"
    named = [{"name": drive} if isinstance(drive, str) else dict(drive) for drive in drives]
    return EtherCatSegment({"interface": at, "drives": named}, at)
