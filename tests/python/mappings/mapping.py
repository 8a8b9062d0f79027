# SPDX-License-Identifier: Apache-2.0
"""A mapping: what the real-time processors of an application are. Everything else of the application stays as it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import opengpac as gpac
from joining import LISTENER, Joining, free_endpoint


@dataclass(frozen=True)
class Realization:
    """One way to realise processors: the clock, what carries connections, and what each processor is."""

    name: str
    clock: str
    options: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments of `gpac.System`."""
    processors: tuple[Mapping[str, Any], ...] = ({},)
    """Further arguments of `cell.processor`, of the first, the second, … that is made; the last ones are those of all that follow."""
    host: str | None = None
    """The host that joins, a process of this machine, before the first processor is made."""

    @property
    def virtual(self) -> bool:
        """Whether time is a number that the program advances."""
        return self.clock == "virtual"

    def open(self, name: str) -> MappedSystem:
        """A system whose processors are what this mapping says."""
        return MappedSystem(name, self)


class MappedSystem(gpac.System):
    """A system in which `processor(name)` makes what its mapping says, so that a program names no hardware."""

    def __init__(self, name: str, mapping: Realization) -> None:
        super().__init__(name, clock=mapping.clock, progress=False, **mapping.options)
        self._made = 0
        self._mapping = mapping
        self._joining: Joining | None = None
        if mapping.host is not None:
            endpoint = free_endpoint()
            self.listen(endpoint, LISTENER)
            self._joining = Joining(name, endpoint, mapping.host)
            # A busy machine takes long to start it; how long a processor waits for its host begins after that.
            self._joining.first_line()

    @property
    def is_virtual(self) -> bool:
        """Whether the program advances time."""
        return self._mapping.virtual

    def close(self) -> None:
        """Closes the system; its host ends with it."""
        super().close()
        if self._joining is not None:
            joining, self._joining = self._joining, None
            joining.kill()

    def processor(self, name: str, core: int | None = None, **options: Any) -> gpac.Processor:
        """A processor of the mapping."""
        given = self._mapping.processors[min(self._made, len(self._mapping.processors) - 1)]
        self._made += 1
        return super().processor(name, core, **{**given, **options})


FAULTY = {"kind": "message", "seed": 7, "delay_ns": [0, 100_000], "drop": 0.02, "repeat": 0.02, "reorder": 0.02, "corrupt": 0.01}
"""A message link that loses, delays, repeats, reorders and corrupts."""

PATIENT = {"lost_after": "10 s"}
"""What goes on in a process is tested here, not how soon it counts as lost: a shared machine may hold it up for longer than by default."""

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
"""The first a thread, the others threads of a process that has joined: over the network of this machine."""

EVERYWHERE = Realization("everywhere", "monotonic", processors=({}, {"process": True, **PATIENT}, {"host": "cell-b"}), host="cell-b")
"""A thread, a process, and threads of a process that has joined: all three ways at once, and that from a process to another host."""
