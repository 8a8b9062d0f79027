# SPDX-License-Identifier: Apache-2.0
"""Processors, on which interrupt sources are created and drivers opened."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from ..devices.physical import PhysicalDevice
from ..drivers import Driver
from ..errors import CallError, refusals, refuse
from ..refusals.argument_types import all_taking, whole
from ..refusals.declared_names import DeclaredNames
from ..refusals.source_location import here
from ..values.quantities import Quantity, span_ns
from ..values.tables import Table, TableDisplay
from .clock import SystemTime
from .sources import Source

if TYPE_CHECKING:
    from .system import System


@all_taking
class Processor(TableDisplay, DeclaredNames):
    """A real-time processor: one instruction stream, with interrupt sources and the physical devices that it can reach.

    Created by `cell.processor("rtp0")`.
    """

    def __init__(self, system: System, name: str, apart: bool | None = None) -> None:
        self.system = system
        self.name = name
        self.apart = apart
        """True if the processor has a separate process, here or on another host; None if another program has created it."""

    def timer(self, name: str, period: Quantity, priority: int = 50, *, virtual_cost: Quantity = 0) -> Source:
        """Creates a timer, which releases at the multiples of `period` from the epoch. A larger `priority` (1 to 98) preempts a smaller
        one.

        `name` is unique within the processor. `virtual_cost` is the duration of each of its firings under the virtual clock, so that
        sources of higher priority preempt it there; on the monotonic clock it has no effect. Raises `ValueRefused` for a period (at
        least 10 µs) or priority out of range, `InUse` if another source has that name.
        """
        return self._source(name, "timer", span_ns(period, f"the period of timer '{name}'"), priority, virtual_cost)

    def trigger(self, name: str, priority: int = 50, *, virtual_cost: Quantity = 0) -> Source:
        """Creates a source that is raised by a device event or by `request()`; it runs the blocks that are placed on it.

        `name`, `priority` and `virtual_cost` are as in `timer`.
        """
        return self._source(name, "trigger", 0, priority, virtual_cost)

    def software(self, name: str, priority: int = 50, *, virtual_cost: Quantity = 0) -> Source:
        """Creates a source that other processors raise; its blocks take the values of those processors synchronously.

        `name`, `priority` and `virtual_cost` are as in `timer`.
        """
        return self._source(name, "software", 0, priority, virtual_cost)

    def physical_device(self, name: str, driver: Driver, exchange: Source) -> PhysicalDevice:
        """Opens a `driver` as the physical device `name`.

        Its channels are read at the start of each firing of `exchange` and written at its end. Raises `DeviceFailed` if it cannot be
        opened, `InUse` if another device has that name.
        """
        if not isinstance(driver, Driver):
            refuse(CallError, f"physical device '{name}' needs a driver, not {driver!r}", "pass a driver: gpac.drivers.mujoco('arm.xml')")
        if not isinstance(exchange, Source):
            refuse(
                CallError,
                f"exchange= of physical device '{name}' must be an interrupt source, not {exchange!r}",
                "pass the source that exchanges with it",
            )
        asked = {"driver": driver.kind, "options": driver.options, "exchange": exchange.name}
        if self.system._by_name.equal("physical device", name, asked):
            return self.system.physical_devices[name]
        with refusals:
            described = self.system._alive().physical_device(
                self.name, name, driver.kind, exchange.name, cast(dict[str, Any], driver.options), here().json()
            )
        device = PhysicalDevice(self.system, name, exchange, described)
        self.system.physical_devices[name] = device
        self.system._by_name.keep("physical device", name, asked, device)
        return device

    def _source(self, name: str, kind: str, period_ns: int, priority: int, cost: Quantity) -> Source:
        priority = whole(priority, f"the priority of source '{name}'", 1, 98)
        cost_ns, full = span_ns(cost, f"the virtual cost of source '{name}'"), f"{self.name}.{name}"
        asked = {"kind": kind, "period": f"{period_ns / 1e6:g} ms", "priority": priority, "virtual_cost": f"{cost_ns / 1e3:g} us"}
        if self.system._by_name.equal("source", full, asked):
            return self.system.sources[full]
        with refusals:
            self.system._alive().source(self.name, name, kind, priority, period_ns, cost_ns)
        source = Source(self.system, self, name, kind, period_ns, priority)
        self.system.sources[source.name] = source
        self.system._by_name.keep("source", full, asked, source)
        return source

    def _table(self) -> Table:
        own = [s for s in self.system.sources.values() if s.processor is self]
        rows = [(s.name, s.kind, f"{s.period * 1e3:g} ms" if s.kind == "timer" else "", s.priority) for s in own]
        return Table(f"processor {self.name}", ["source", "kind", "period", "priority"], rows)

    def __repr__(self) -> str:
        sources = [s.name.split(".", 1)[1] for s in self.system.sources.values() if s.processor is self]
        return f"processor {self.name} of system '{self.system.name}': {', '.join(sources) or 'no interrupt sources'}"


def system_of(where: Any) -> System:
    """Returns the system of a source or a processor, or the system itself."""
    if isinstance(where, SystemTime):
        return cast("System", where)
    if isinstance(where, Source | Processor):
        return where.system
    refuse(CallError, f"a verb cannot be placed on {where!r}", "pass an interrupt source, {'label': source}, or a system")
