# SPDX-License-Identifier: Apache-2.0
"""Base class of drivers in Python, and its channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import CallError, did_you_mean, refuse
from .members import NEEDED, Channel, Counter, NamedMember, NothingNew, OptionMember, Part, PartValues, annotated


class Driver:
    """Base class of drivers in Python. An object represents one open device; a single thread calls all of its methods.

    An exception in a method causes `device_lost` with its text; in `open` it is the reason why the device cannot be opened.
    `reopen()` or `reset()` recovers a lost device by creating a new object in a new process.
    """

    def __init__(self, **options: Any) -> None:
        declared = self.members(OptionMember)
        for wrong in options.keys() - declared.keys():
            refuse(CallError, f"driver {type(self).__name__} has no option '{wrong}'", did_you_mean(wrong, declared))
        for name, option in declared.items():
            given = options.get(name, option.default)
            if given is NEEDED:
                refuse(CallError, f"driver {type(self).__name__} needs option '{name}'", f"pass {name}: {option.doc}")
            what = f"option '{name}' of driver {type(self).__name__}"
            self.__dict__[name] = option.taken(annotated(type(self), name), given, what) if name in options else given
        for name, channel in self.members(Channel).items():
            self.__dict__[name] = channel.initial
        for name, declared_part in self.members(Part).items():
            self.__dict__[name] = PartValues(declared_part)
        for name in self.members(Counter):
            self.__dict__[name] = 0

    @classmethod
    def members(cls, kind: type[Any]) -> Mapping[str, Any]:
        """Returns the members of the kind `kind` that the class and its bases declare, by name."""
        return {n: m for base in reversed(cls.__mro__) for n, m in vars(base).items() if isinstance(m, kind)}

    @classmethod
    def scan(cls, **options: Any) -> Sequence[Mapping[str, Any]]:
        """Searches for devices that the class can open. Must not move anything. `options` are the checked options of the class that
        limit the search.

        Returns the devices found, each as `{"what": "a thermometer, number 4711", "options": {"port": "/dev/ttyS0"}}`. Most buses
        support a search; a class that cannot search does not override this method.
        """
        raise NotImplementedError(f"{cls.__name__} has no scan()")

    def open(self) -> None:
        """Opens the device. Called once. If it raises an exception, the device cannot be opened, and the exception is the reason."""

    def exchange(self) -> float | NothingNew | None:
        """Exchanges values with the machine once per period: written channels hold the commands, and the method must set the read
        channels.

        Returns None if the readings are current, their age in s if the machine reports it, or `NOTHING_NEW` if it reported nothing;
        the previous readings then remain, and the channel `age` keeps increasing.
        """
        raise NotImplementedError(f"{type(self).__name__} has no exchange()")

    def safe_state(self) -> None:
        """Brings the outputs to their safe state. Called when the program has exited or stops commanding, after a failure, and before
        `close`."""

    def close(self) -> None:
        """Closes the device. Called once, even after a failure."""


def channels_of(kind: type[Driver]) -> dict[str, Channel]:
    """Returns the channels of a class by name, including those of its parts, in the order in which they are declared."""
    found: dict[str, Channel] = {}
    for name, member in kind.members(NamedMember).items():
        if isinstance(member, Channel):
            found[name] = member
        elif isinstance(member, Part):
            found |= {channel.name: channel for channel in member.channels.values()}
    return found


def place_of(driver: Driver, channel: Channel) -> tuple[dict[str, Any], str]:
    """Returns the location at which the object stores a channel's value: a dictionary, and a key in it."""
    part, _, word = channel.name.rpartition(".")
    return (vars(driver.__dict__[part]) if part else driver.__dict__), word
