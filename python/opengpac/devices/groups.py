# SPDX-License-Identifier: Apache-2.0
"""Groups of logical devices: an arm is a group of joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, overload

from ..application.arguments import Argument
from ..errors import CallError, UnknownName, did_you_mean, refuse
from ..refusals.argument_types import all_taking
from ..refusals.declared_names import DeclaredNames
from ..system.svvs import rows_of
from ..values.arrays import np
from ..values.encoding import plain
from ..values.numbers import number
from ..values.quantities import Quantity, optional_ns
from ..values.tables import Table, TableDisplay, identifiers
from .enabling import enable
from .logical import LogicalDevice

if TYPE_CHECKING:
    from ..system.system import System

D = TypeVar("D", bound=LogicalDevice)


@all_taking
class Group(TableDisplay, DeclaredNames, Argument, Generic[D]):
    """Several logical devices in a fixed order: `arm[0]`, `arm["elbow"]`, `arm.elbow`. A verb on a group takes one goal for each device.

    A device is identified by its full name, or by its last words, `arm["left.elbow"]`, if they are unique (`short_names`).

    In `Group("arm", shoulder, elbow)`, `arm` is the name used in messages. Raises `CallError` unless there is at least one device and
    all belong to one system.

    A member can be set in all devices: `arm.max_speed = 0.5`, `arm.kp = [80, 80, 40]`, `arm.kp = {"elbow": 60}`.
    """

    _settable = frozenset({"model"})

    def __init__(self, name: str, *devices: D) -> None:
        if not devices:
            refuse(CallError, f"group '{name}' has no devices", "pass at least one")
        for device in devices:
            if not isinstance(device, LogicalDevice):
                refuse(CallError, f"members of group '{name}' must be logical devices, not {device!r}", "pass logical devices")
        if len({device.system for device in devices}) > 1:
            refuse(CallError, f"group '{name}' has devices from several systems", "pass devices of one system")
        self.name = name
        self.model = ""
        """Identifier of the arm's mechanics, for example the hash of the model file from which it was loaded."""
        self._devices = devices

    @property
    def system(self) -> System:
        """System of the devices."""
        return self._devices[0].system

    def enable(self, timeout: Quantity | None = "10 s") -> Self:
        """Enables all devices and returns when all are ready. After `timeout`, disables all of them and raises `TimeoutError`."""
        enable(self._devices, optional_ns(timeout, "the timeout"))
        return self

    def pause(self) -> list[str]:
        """Pauses the actions on these devices, as `System.pause` does for the whole system; returns the names of the instances that it
        suspended."""
        return self.system.pause(*self._devices)

    def resume(self) -> list[str]:
        """Ends the pause; returns the names of the resumed instances."""
        return self.system.resume(*self._devices)

    def disable(self) -> None:
        """Disables all devices."""
        for device in self._devices:
            device.disable()

    @contextmanager
    def enabled(self, timeout: Quantity | None = "10 s") -> Generator[Self]:
        """Enables the devices; `with arm.enabled():` disables them at the end of the block. `timeout` is as in `enable`."""
        self.enable(timeout)
        try:
            yield self
        finally:
            if not self.system.closed:
                self.disable()

    def values(self, member: str) -> list[Any]:
        """Returns the value of `member` for each device: `arm.values("sensed")`; for SVVs, as one consistent snapshot."""
        kind = type(self._devices[0])
        if member in kind.svv_members():
            return list(self.system.read(*(getattr(device, member) for device in self._devices)))
        if member in kind.parameter_members():
            return [getattr(device, member) for device in self._devices]
        refuse(
            UnknownName, f"{kind.__name__} has no member '{member}'", did_you_mean(member, [*kind.svv_members(), *kind.parameter_members()])
        )

    @property
    def override(self) -> float:
        """Speed override for motions of the devices, from 0 to 1; 0 holds them. Setting it sets the override of each device."""
        return min(self.values("override"))

    @override.setter
    def override(self, share: float) -> None:
        self.values("override")
        for device in self._devices:
            svv: Any = getattr(device, "override")  # noqa: B009 - a member that its type may have
            svv.value = share

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_") or not self._whole or self._takes(name) or name not in self._members():
            super().__setattr__(name, value)
        else:
            self._set_each(name, value)

    def _members(self) -> list[str]:
        """Returns the members that at least one of the devices has."""
        return list(dict.fromkeys(name for d in self._devices for name in (*d.svv_members(), *d.parameter_members())))

    def _set_each(self, member: str, value: Any) -> None:
        """Sets a member of each device; if any device refuses its value, sets none."""
        for device in self._devices:
            if member not in device.svv_members() and member not in device.parameter_members():
                what = f"{device.definition_name()} '{device.name}' of group '{self.name}'"
                refuse(CallError, f"{what} has no member '{member}'", f"set it for the other devices: group['…'].{member} = …")
        before = self.values(member)
        given = self._one_for_each(member, value, before)
        done: list[tuple[D, Any]] = []
        try:
            for device, new, old in zip(self._devices, given, before, strict=True):
                setattr(device, member, new)
                done.append((device, old))
        except BaseException:
            for device, old in done:
                setattr(device, member, old)
            raise

    def _one_for_each(self, member: str, value: Any, before: Sequence[Any]) -> Sequence[Any]:
        """Returns one value for each device: the same for all, or, for a scalar member, individual ones; devices missing from a mapping
        keep their values."""
        if np.ndim(before[0]) > 0 or isinstance(before[0], np.void):
            return [value] * len(self._devices)
        if isinstance(value, Mapping):
            own = {self[str(name)].name: new for name, new in value.items()}
            return [own.get(device.name, old) for device, old in zip(self._devices, before, strict=True)]
        if np.ndim(value) == 0:
            return [value] * len(self._devices)
        value = plain(value, f"'{member}' of group '{self.name}'")
        if len(value) != len(self._devices):
            remedy = f"pass one for all, one for each, or {{'{self.short_names[0]}': …}}"
            refuse(
                CallError,
                f"'{member}' of group '{self.name}' needs one value for each of its {len(self._devices)} devices, not {len(value)}",
                remedy,
            )
        return value

    def _instead(self, name: str) -> str:
        if name in self._ipython_key_completions_():
            return f"it is a device, so set one of its members: {name}.…"
        return did_you_mean(name, self._members())

    def _called(self) -> str:
        return f"group '{self.name}'"

    def _argument(self) -> dict[str, Any]:
        return {"devices": [device._argument()["device"] for device in self._devices]}

    @property
    def short_names(self) -> list[str]:
        """Names of the devices in order, each shortened to the fewest last words that are unique: `elbow`, or `left.elbow`."""
        names = [device.name for device in self._devices]
        counts = Counter(ending for name in names for ending in _endings(name))
        return [next((ending for ending in _endings(name) if counts[ending] == 1), name) for name in names]

    def __iter__(self) -> Iterator[D]:
        return iter(self._devices)

    def __len__(self) -> int:
        return len(self._devices)

    @overload
    def __getitem__(self, which: int | str) -> D: ...
    @overload
    def __getitem__(self, which: slice) -> Sequence[D]: ...
    def __getitem__(self, which: int | str | slice) -> D | Sequence[D]:
        which = number(which)
        if isinstance(which, int | slice):
            return self._devices[which]
        if not isinstance(which, str):
            refuse(
                CallError,
                f"the index of group '{self.name}' must be a number, a slice or a name, not {which!r}",
                "write group[0] or group['elbow'], for example",
            )
        found = [device for device in self._devices if device.name == which] or [d for d in self._devices if which in _endings(d.name)]
        if not found:
            refuse(UnknownName, f"group '{self.name}' has no device '{which}'", did_you_mean(which, self.short_names))
        if len(found) > 1:
            called = [name for device, name in zip(self._devices, self.short_names, strict=True) if device in found]
            what = f"group '{self.name}' has {len(found)} devices named '{which}'"
            refuse(UnknownName, what, f"use a longer name: {', '.join(map(repr, called))}")
        return found[0]

    def __getattr__(self, name: str) -> D:
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self._members() and name not in self._ipython_key_completions_():
            refuse(
                UnknownName,
                f"'{name}' is a member of each device of group '{self.name}', not of the group",
                f"write .values('{name}') for all of them",
            )
        return self[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *identifiers(self._ipython_key_completions_())]

    def _ipython_key_completions_(self) -> list[str]:
        return self.short_names

    def _table(self) -> Table | None:
        if self.system.closed:
            return None
        members = [*dict.fromkeys(name for device in self._devices for name in device.svv_members())]
        rows: list[list[Any]] = []
        for device, short_name in zip(self._devices, self.short_names, strict=True):
            there = [name for name in members if name in device.svv_members()]
            read = rows_of(self.system, [getattr(device, name) for name in there])[1] if there else []
            values = {name: value for name, (value, *_) in zip(there, read, strict=True)}
            rows.append([short_name, device.state, *(_short(values[name]) if name in values else "" for name in members)])
        return Table(f"group {self.name}", ["device", "state", *members], rows)

    def __repr__(self) -> str:
        return f"group {self.name}: {', '.join(self.short_names)}"


def _endings(name: str) -> list[str]:
    """Returns the suffixes of a name: the last word, the last two words, and so on."""
    words = name.split(".")
    return [".".join(words[-count:]) for count in range(1, len(words) + 1)]


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
