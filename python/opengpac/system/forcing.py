# SPDX-License-Identifier: Apache-2.0
"""Forced signals of a system: inputs and outputs that have a value of a person's choice instead of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .. import checking
from ..devices.logical import LogicalDevice
from ..errors import CallError, refusals, refuse
from ..values.encoding import plain

if TYPE_CHECKING:
    from types import TracebackType

    from .system import System


@dataclass(frozen=True)
class ForcedSignal:
    """A forced signal: its `channel`, whether it is an `output`, its `value`, `who` forces it, and when the force began (s of the
    system's clock)."""

    number: int
    channel: str
    output: bool
    value: Any
    who: str
    since: float


class Force:
    """A forced signal, which `release` ends: `with cell.force(part, True):` releases it at the end of the block.

    `release` does nothing if the force has already ended because another force replaced it, its device was disabled or lost, or an
    emergency stop occurred.
    """

    def __init__(self, system: System, name: str, number: int) -> None:
        self.system, self.name = system, name
        self._number = number

    @property
    def active(self) -> bool:
        """True if this force is still in effect."""
        now = forced(self.system).get(self.name)
        return now is not None and now.number == self._number

    def release(self) -> None:
        """Ends the force: the signal has its own value again."""
        if not checking.active() and self.active:
            with refusals:
                self.system._alive().unforce(self.name)

    def __enter__(self) -> Force:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        # A system that was closed in the block forces nothing.
        if not self.system.closed:
            self.release()

    def __repr__(self) -> str:
        return f"force of '{self.name}'"


def force(system: System, signal: LogicalDevice, value: Any) -> Force:
    """Forces a signal of a system."""
    name = _named(signal, "force")
    with refusals:
        given = plain(value, f"the value for '{name}'")
    number = 0
    if not checking.active():
        with refusals:
            number = system._alive().force(name, given)
    return Force(system, name, number)


def release(system: System, signals: tuple[Any, ...]) -> list[str]:
    """Ends the forces of these signals, or of all; returns the names of the signals."""
    names = [_named(signal, "release") for signal in signals]
    if checking.active():
        return names
    with refusals:
        native = system._alive()
        return [freed for name in names or [None] for freed in native.unforce(name)]


def forced(system: System) -> dict[str, ForcedSignal]:
    """Returns the forced signals of a system, by name."""
    with refusals:
        now = system._alive().forced()
    return {name: ForcedSignal(since=of.pop("since_s"), **of) for name, of in now.items()}


def _named(signal: Any, call: str) -> str:
    if not isinstance(signal, LogicalDevice):
        refuse(
            CallError,
            f"the argument of {call}() must be an input or output, not {signal!r}",
            "give an input or output: gpac.cell.DigitalInput('part', io['part'])",
        )
    return signal.name
