# SPDX-License-Identifier: Apache-2.0
"""Physical devices: typed channels of a driver with units, grouped into parts (joints) if the machine has them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ..application.arguments import Argument
from ..drivers.catalog import safe_state_text
from ..errors import CallError, UnknownName, did_you_mean, refusals, refuse
from ..refusals.declared_names import DeclaredNames
from ..refusals.source_location import here
from ..system.sources import Source
from ..values.arrays import np
from ..values.encoding import decoder_of, dtype_of
from ..values.tables import Table, TableDisplay, Tables, identifiers
from .services import Services

if TYPE_CHECKING:
    from ..system.realtime import RealTimeSystem
    from ..system.system import System


class Channel(DeclaredNames, Argument):
    """A channel of a physical device: `name`, `type`, `unit`, and its direction. Obtained from its device: `ur5e["elbow"].position`.

    `type` is a C type; numbers are in `unit`, which is empty if the channel has none. Verbs bind to it; a program reads it with
    `cell.read(channel)`, and only blocks write it. Raises `UnknownName` if its device has been deleted.
    """

    def __init__(self, device: PhysicalDevice, described: Mapping[str, Any]) -> None:
        self.device = device
        self.system: System = device.system
        self.name: str = described["name"]
        self.write: bool = described["write"]
        self.type: str = described["type_text"]
        self.unit: str = described["unit"]

    @functools.cached_property
    def _about(self) -> dict[str, Any]:
        with refusals:
            return self.system._alive().svv_about(f"{self.full_name}@channel")

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy dtype of the value."""
        return dtype_of(self._about["type"])

    @functools.cached_property
    def _decode(self) -> Callable[[bytes], Any]:
        """Returns a function that decodes the bytes of a value."""
        return decoder_of(self._about["type"])

    @property
    def full_name(self) -> str:
        """Name in the system, `plant.elbow.position`."""
        return f"{self.device.name}.{self.name}"

    @property
    def _asked(self) -> str:
        """Name of the channel in requests, distinct from that of an SVV. Refuses a deleted device whose name has been reused by another
        device."""
        self.device._here()
        return f"{self.full_name}@channel"

    def _argument(self) -> dict[str, Any]:
        self.device._here()
        return {"channel": {"device": self.device.name, "channel": self.name}}

    def raises(self, source: Source) -> None:
        """Makes the channel raise a trigger or software `source`, on any processor, each time its value changes from zero to nonzero.

        The channel is checked in each firing of the source that exchanges with its device; the first reading never raises the source.
        """
        if not isinstance(source, Source):
            refuse(
                CallError,
                f"channel '{self.device.name}.{self.name}' must trigger a source, not {source!r}",
                "pass a source: rtp.trigger('door')",
            )
        native = self.device._here()
        with refusals:
            native.raises(self.device.name, self.name, source.name, here().json())

    def _instead(self, name: str) -> str:
        return "write it with a block: write_channel" if name == "value" else ""

    def _called(self) -> str:
        return f"channel '{self.device.name}.{self.name}'"

    def __repr__(self) -> str:
        way = "written" if self.write else "read"
        return f"channel {self.device.name}.{self.name} ({self.type}{', ' + self.unit if self.unit else ''}), {way}"


class _Channels(TableDisplay, DeclaredNames):
    """Channels by the last word of their names, as attributes and items."""

    def _find(self, name: str) -> Any:
        raise NotImplementedError

    def _instead(self, name: str) -> str:
        return "write it with a block: write_channel" if name in self._names() else ""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self._find(name)

    def __getitem__(self, name: str) -> Any:
        return self._find(name)

    def _names(self) -> list[str]:
        raise NotImplementedError

    def _ipython_key_completions_(self) -> list[str]:
        return self._names()

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *identifiers(self._names())]


def _channel_table(title: str, channels: Mapping[str, Channel]) -> Table:
    rows = [(name, c.type, c.unit, "written" if c.write else "read") for name, c in channels.items()]
    return Table(title, ["channel", "type", "unit", "way"], rows)


class Part(_Channels, Argument):
    """A part of a machine, for example a joint. Obtained from its `device`, `ur5e["elbow"]`.

    `about` contains the driver's declarations: range, limits, suitable gains, in the units of its channels. Raises `UnknownName` for
    a channel that it does not have.
    """

    def __init__(self, device: PhysicalDevice, about: Mapping[str, Any]) -> None:
        self.device = device
        self.system: System = device.system
        self.about = about
        self.name: str = about["name"]

    @property
    def channels(self) -> dict[str, Channel]:
        """Channels by their short names."""
        prefix = f"{self.name}."
        return {n.removeprefix(prefix): c for n, c in self.device.channels.items() if n.startswith(prefix)}

    def _argument(self) -> dict[str, Any]:
        self.device._here()
        return {"part": {"device": self.device.name, "part": self.name}}

    def _find(self, name: str) -> Channel:
        if name not in self.channels:
            refuse(
                UnknownName, f"part '{self.name}' of device '{self.device.name}' has no channel '{name}'", did_you_mean(name, self.channels)
            )
        return self.channels[name]

    def _names(self) -> list[str]:
        return [*self.channels]

    def _table(self) -> Table:
        return _channel_table(repr(self).partition(":")[0], self.channels)

    def __repr__(self) -> str:
        return f"part {self.device.name}.{self.name}: {', '.join(self.channels)}"


class PhysicalDevice(_Channels):
    """A driver that a processor can reach. Created by `processor.physical_device(name, driver, exchange)`.

    `parts` are its joints; `device["elbow"]` is one of them, `device["tool.force"]` a channel. `source` is the interrupt source that
    exchanges with it; `about` contains the driver's declarations.
    """

    def __init__(self, system: System, name: str, source: Source, about: Mapping[str, Any]) -> None:
        self.system = system
        self.name = name
        self.source = source
        self.about: Mapping[str, Any] = about
        self.channels = {c["name"]: Channel(self, c) for c in about["channels"]}
        parts = about.get("parts") or []
        if isinstance(parts, dict):
            parts = parts.get("parts", [])
        self._parts = {p["name"]: Part(self, p) for p in parts}
        self.services = Services(self)
        """Acyclic services of the driver, as methods: `device.services.home(joint="elbow")`."""

    @property
    def parts(self) -> list[str]:
        """Names of the parts, in the machine's order."""
        return [*self._parts]

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the driver, by name, for example of lost frames or late answers. A counter of a remote device is 0 until its
        processor reports it."""
        self._here()
        known = self.system.statistics["physical_devices"].get(self.name)
        if known is None:
            refuse(UnknownName, f"physical device '{self.name}' was deleted, so it has no counters")
        return {word["name"]: 0 for word in self.about.get("counters", [])} | known["counters"]

    def reopen(self) -> None:
        """Reopens a lost device with its original options; bindings to it remain valid. Does nothing if the device is not lost.

        `cell.reset()` does so for every lost device. If the driver still cannot reach the machine, raises `DeviceFailed` with the
        cause, and the device stays lost.
        """
        with refusals:
            self.system._alive().reopen_physical_device(self.name)

    def delete(self) -> None:
        """Puts the outputs in their safe state and closes the device; refused while a device or verb instance is bound to it."""
        native = self._here()
        with refusals:
            native.delete_physical_device(self.name)
        self.system.physical_devices.pop(self.name, None)
        self.system._by_name.forget("physical device", self.name)

    def _here(self) -> RealTimeSystem:
        """Returns the device's system. Refuses a deleted device whose name has been reused by another device, because its channels may
        differ."""
        if self.system.physical_devices.get(self.name, self) is not self:
            refuse(
                UnknownName,
                f"this physical device '{self.name}' was deleted, and its name is now used by another one",
                "use the parts and channels of the new one",
            )
        return self.system._alive()

    def __iter__(self) -> Iterator[Part]:
        return iter(self._parts.values())

    def _find(self, name: str) -> Part | Channel:
        found = self._parts.get(name) or self.channels.get(name)
        if found is None:
            refuse(UnknownName, f"device '{self.name}' has no part or channel '{name}'", did_you_mean(name, [*self._parts, *self.channels]))
        return found

    def _names(self) -> list[str]:
        return [*self._parts, *self.channels]

    def _table(self) -> Table | Tables:
        channels = _channel_table(f"physical device {self.name} on {self.source.name}", self.channels)
        safe, words = self.about.get("safe_state"), {word["name"]: word for word in self.about.get("counters") or []}
        beside = [self.services._table()] if self.services else []
        if words and not self.system.closed and self.system.physical_devices.get(self.name) is self:
            counted = [(name, count, words[name]["unit"], words[name]["doc"]) for name, count in self.counters.items() if name in words]
            beside.append(Table(f"counters of {self.name}", ["counter", "value", "unit", "meaning"], counted))
        if safe is None and not beside:
            return channels
        return Tables([channels, *beside], f"safe state: {safe_state_text(safe)}" if safe else "")

    def _called(self) -> str:
        return f"physical device '{self.name}'"

    def __repr__(self) -> str:
        return f"physical device {self.name} on {self.source.name}: {', '.join(self.parts) or ', '.join(self.channels)}"
