# SPDX-License-Identifier: Apache-2.0
"""A segment of EtherCAT that is only a program."""

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
    """The distributed clock of an emulated drive."""

    delay_ns: int
    """How long a frame takes to it from the reference clock, as a main device wrote it."""
    difference_ns: int
    """How far its time is from that of the reference clock."""
    sync0: int
    """How often SYNC0 came in OP."""
    missed: int
    """How often it came without new outputs."""
    margin_ns_min: int
    """The shortest time that new outputs were there before SYNC0."""
    margin_ns_max: int
    """The longest one."""


@dataclass(frozen=True)
class Drive:
    """State of an emulated drive."""

    state: str
    """Its state, and what is wrong with it: `OP`, `SAFEOP with error 0x001b, …`."""
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
    clock: Clock
    """Its distributed clock."""


@dataclass(frozen=True)
class Terminal:
    """State of an emulated terminal."""

    position: int
    """Its place on the line."""
    state: str
    """Its state, and what is wrong with it."""
    outputs: list[int]
    """What its outputs carry: 0 and 1, or counts."""


class EtherCatSegment(EmulatedBus):
    """Emulated drives and terminals on a line, in a process of their own.

    `ethercat()` starts one. It ends with `close()`, a `with`, or its program.
    """

    interface: str
    """What a main device opens: the name of an interface, or `local:NAME`."""

    def __init__(self, options: Mapping[str, Any], interface: str) -> None:
        self.interface = interface
        super().__init__("run_ethercat_segment", "the emulated segment", options)

    def drives(self) -> list[Drive]:
        """Returns the present state of each drive, in their order."""
        return [Drive(**{**drive, "clock": Clock(**drive["clock"])}) for drive in self._shown()["drives"]]

    def terminals(self) -> list[Terminal]:
        """Returns the present state of each terminal, in their order."""
        return [Terminal(**terminal) for terminal in self._shown()["terminals"]]

    def put(self, position: int, input: int, value: float) -> None:
        """Puts this on the wire of an input, counted from 0, of the terminal at this position: 0 and 1, or counts of an analog one."""
        self._say({"do": "put", "position": position, "input": input, "value": int(value)})

    def counts(self) -> dict[str, int]:
        """Frames that came, and how many of them were malformed, lost or spoiled on purpose."""
        return self._shown()["counts"]

    def cut(self, position: int = 0) -> None:
        """Pulls the cable that leads to the drive of this position."""
        self._say({"do": "cut", "position": position})

    def heal(self) -> None:
        """Puts the cable back."""
        self._say({"do": "heal"})

    def power(self, position: int, on: bool) -> None:
        """Switches the voltage of a drive. With it comes a drive that knows nothing, its axis where it was."""
        self._say({"do": "power", "position": position, "on": on})

    def swap(self, position: int, other: int) -> None:
        """Exchanges two drives on the line, as somebody does who mixes up their cables. Both are without voltage meanwhile."""
        self._say({"do": "swap", "position": position, "other": other})

    def fail(self, position: int, error: int = 0x7121) -> None:
        """Makes a drive find something wrong: an error code of CiA 402, here that its motor is blocked."""
        self._say({"do": "fail", "position": position, "error": error})

    def enable_input(self, position: int, closed: bool) -> None:
        """Closes or opens the enable input of a drive; while it is open, the drive stays in "switch on disabled"."""
        self._say({"do": "enable_input", "position": position, "closed": closed})


@taking
def ethercat(*drives: str | Mapping[str, Any], interface: str | None = None) -> EtherCatSegment:
    """An emulated segment of terminals and of drives by CiA 402 with motors that follow, as every main device sees it.

    A drive is its name, or `{"name": "x", "position": 1000, "watchdog": False}`: where it stands at the start in counts, and whether it
    has the watchdog of its outputs; `clock_ppm`, by how many millionths its clock is too fast; `cable_ns`, how long a frame takes to it
    from the drive before it; `limits`, where the switches at the ends of its machine are in counts; `falls`, that it has a brake, and a
    load that falls so fast where nothing holds it, counts/s; `serial` (else its place, from 1) and `alias`, by which it is identified.
    With `terminal` it is a terminal, `{"name": "io", "terminal": {"digital_inputs": 8}}`: `digital_inputs` and `digital_outputs`, or
    `analog_inputs` and `analog_outputs` of 16 bits; `{}` is a coupler.
    Without `interface` it answers on a local socket that needs no rights; with the name of one it answers on that, as on one end of a veth
    pair, which needs CAP_NET_RAW.
    """
    if not drives:
        refuse(CallError, "a segment has no drive", 'name them: gpac.drivers.fake.ethercat("x", "y")')
    at = interface if interface is not None else f"local:{secrets.token_hex(8)}"
    named = [{"name": drive} if isinstance(drive, str) else dict(drive) for drive in drives]
    return EtherCatSegment({"interface": at, "drives": named}, at)
