# SPDX-License-Identifier: Apache-2.0
"""A mapping: what the real-time processors of an application are. Everything else of the application stays as it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import opengpac as gpac


@dataclass(frozen=True)
class Realization:
    """One way to realise processors: the clock, what carries connections, and what each processor is."""

    name: str
    clock: str
    options: Mapping[str, Any] = field(default_factory=dict)
    #: Keyword arguments of `cell.processor` for processor 0, 1, …; the last ones are those of all that follow.
    processors: tuple[Mapping[str, Any], ...] = ({},)

    @property
    def virtual(self) -> bool:
        """Whether time is a number that the program advances."""
        return self.clock == "virtual"

    @contextmanager
    def open(self, name: str) -> Iterator[gpac.System]:
        """A system of this mapping, closed at the end."""
        with gpac.System(name, clock=self.clock, progress=False, **self.options) as cell:
            yield cell

    def processor(self, cell: gpac.System, number: int) -> gpac.Processor:
        """Processor `number` of an application."""
        return cell.processor(f"rtp{number}", **self.processors[min(number, len(self.processors) - 1)])


FAULTY = {"kind": "message", "seed": 7, "delay_ns": [0, 100_000], "drop": 0.02, "repeat": 0.02, "reorder": 0.02, "corrupt": 0.01}

MAPPINGS = {
    mapping.name: mapping
    for mapping in (
        Realization("virtual", "virtual", {"seed": 1}),
        Realization("message", "virtual", {"seed": 1, "interconnect": FAULTY}),
        Realization("threads", "monotonic"),
    )
}
