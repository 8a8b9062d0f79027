# SPDX-License-Identifier: Apache-2.0
"""A mapping: the realisation of an application's real-time processors. The rest of the application is unchanged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import opengpac as gpac
from joining import LISTENER, Joining, free_endpoint


@dataclass(frozen=True)
class Realization:
    """Realisation of processors: the clock, the carrier of connections, and the kind of each processor."""

    name: str
    clock: str
    options: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments of `gpac.System`."""
    processors: tuple[Mapping[str, Any], ...] = ({},)
    """Further arguments of `cell.processor` for the first, the second, … processor; the last entry applies to all further ones."""
    host: str | None = None
    """Host that joins, a process of this machine, before the first processor is created."""

    @property
    def virtual(self) -> bool:
        """True if the program advances time."""
        return self.clock == "virtual"

    def open(self, name: str) -> MappedSystem:
        """Returns a system with the processors of this mapping."""
        return MappedSystem(name, self)


class MappedSystem(gpac.System):
    """System in which `processor(name)` creates the processor of its mapping, so that a program names no hardware."""

    def __init__(self, name: str, mapping: Realization) -> None:
        super().__init__(name, clock=mapping.clock, progress=False, **mapping.options)
        self._made = 0
        self._mapping = mapping
        self._joining: Joining | None = None
        if mapping.host is not None:
            endpoint = free_endpoint()
            self.listen(endpoint, LISTENER)
            self._joining = Joining(name, endpoint, mapping.host)
            # A busy machine takes long to start the host; the time limit of a processor's wait for it begins afterwards.
            self._joining.first_line()

    @property
    def is_virtual(self) -> bool:
        """True if the program advances time."""
        return self._mapping.virtual

    def close(self) -> None:
        """Closes the system, and with it its host."""
        super().close()
        if self._joining is not None:
            joining, self._joining = self._joining, None
            joining.kill()

    def processor(self, name: str, core: int | None = None, **options: Any) -> gpac.Processor:
        """Returns a processor of the mapping."""
        given = self._mapping.processors[min(self._made, len(self._mapping.processors) - 1)]
        self._made += 1
        return super().processor(name, core, **{**given, **options})


FAULTY = {"kind": "message", "seed": 7, "delay_ns": [0, 100_000], "drop": 0.02, "repeat": 0.02, "reorder": 0.02, "corrupt": 0.01}
"""Message link that loses, delays, repeats, reorders and corrupts."""

PATIENT = {"lost_after": "10 s"}
"""Options of processes: these tests concern a process's results, not how soon it counts as lost; a shared machine may delay it beyond
the default."""

IN_A = {"process": "cell-a", **PATIENT}

MAPPINGS = {
    mapping.name: mapping
    for mapping in (
        Realization("virtual", "virtual", {"seed": 1}),
        Realization("message", "virtual", {"seed": 1, "interconnect": FAULTY}),
        Realization("threads", "monotonic"),
        Realization("processes", "monotonic", processors=({"process": True, **PATIENT},)),
        Realization("shared", "monotonic", processors=(IN_A, IN_A, {"process": "cell-b", **PATIENT})),
        Realization("mixture", "monotonic", processors=({}, {"process": True, **PATIENT})),
    )
}

HOSTS = Realization("hosts", "monotonic", processors=({}, {"host": "cell-b"}), host="cell-b")
"""Mapping with a thread first, and then threads of a process that has joined over this machine's network."""

EVERYWHERE = Realization("everywhere", "monotonic", processors=({}, {"process": True, **PATIENT}, {"host": "cell-b"}), host="cell-b")
"""Mapping with a thread, a process, and threads of a process that has joined: all three kinds at once, and links from a process to
another host."""
