# SPDX-License-Identifier: Apache-2.0
"""Base class of drivers in Python, and its channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import CallError, did_you_mean, refuse
from .members import NEEDED, Channel, Counter, NamedMember, NothingNew, OptionMember, Part, PartValues, annotated


class Driver:
    """Base of drivers in Python. One object stands for one open device; all its methods are called by one thread.

    What a method raises is `device_lost` with the exception's text, or why the device cannot be opened. A device that was lost comes
    back with `reopen()` or `reset()`, which make a new object in a new process.
    """

    def __init__(self, **options: Any) -> None:
        declared = self.members(OptionMember)
        for wrong in options.keys() - declared.keys():
            refuse(CallError, f"driver {type(self).__name__} has no option '{wrong}'", did_you_mean(wrong, declared))
        for name, option in declared.items():
            given = options.get(name, option.default)
            if given is NEEDED:
                refuse(CallError, f"driver {type(self).__name__} needs option '{name}'", f"give {name}: {option.doc}")
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
        """Returns the members of that kind that the class and its bases declare, by name."""
        return {n: m for base in reversed(cls.__mro__) for n, m in vars(base).items() if isinstance(m, kind)}

    @classmethod
    def scan(cls, **options: Any) -> Sequence[Mapping[str, Any]]:
        """Looks for devices that the class could open; nothing moves. `options` are those of the class, checked, that say where to look.

        Returns what is found, `{"what": "a thermometer, number 4711", "options": {"port": "/dev/ttyS0"}}` each. Most buses can be asked;
        a class that cannot look leaves it as it is.
        """
        raise NotImplementedError(f"{cls.__name__} has no scan()")

    def open(self) -> None:
        """Opens the device; called once. What it raises is why it cannot be opened."""

    def exchange(self) -> float | NothingNew | None:
        """Exchanges values with the machine, once a period: channels that are written hold commands, those that are read are to be set.

        Returns nothing where the readings are of now, how old they are, s, where the machine tells, and `NOTHING_NEW` where it has told
        nothing: the readings stay those from before, and the channel `age` goes on growing.
        """
        raise NotImplementedError(f"{type(self).__name__} has no exchange()")

    def safe_state(self) -> None:
        """Brings the outputs to their safe state: where the program is gone or commands no more, after a failure, and before `close`."""

    def close(self) -> None:
        """Closes the device; called once, also after a failure."""


def channels_of(kind: type[Driver]) -> dict[str, Channel]:
    """The channels of a class by name, those of its parts too, in the order in which they are declared."""
    found: dict[str, Channel] = {}
    for name, member in kind.members(NamedMember).items():
        if isinstance(member, Channel):
            found[name] = member
        elif isinstance(member, Part):
            found |= {channel.name: channel for channel in member.channels.values()}
    return found


def place_of(driver: Driver, channel: Channel) -> tuple[dict[str, Any], str]:
    """Returns where a channel has its value on the object: a dictionary, and the name in it."""
    part, _, word = channel.name.rpartition(".")
    return (vars(driver.__dict__[part]) if part else driver.__dict__), word
