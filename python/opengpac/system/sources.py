# SPDX-License-Identifier: Apache-2.0
"""Interrupt sources, and the placement of blocks on them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import CallError, refusals, refuse
from ..refusals.declared_names import DeclaredNames

if TYPE_CHECKING:
    from .processors import Processor
    from .system import System


class Source(DeclaredNames):
    """An interrupt source. Created by `processor.timer`, `processor.trigger` and `processor.software`.

    `name` is `processor.source`; `kind` is `timer`, `trigger` or `software`; `period` is the period of a timer, in s, otherwise 0;
    `priority` is 1 to 98.
    """

    def __init__(self, system: System, processor: Processor, name: str, kind: str, period_ns: int, priority: int) -> None:
        self.system = system
        self.processor = processor
        self.name = f"{processor.name}.{name}"
        self.kind = kind
        self.period = period_ns * 1e-9
        self.priority = priority

    def request(self) -> None:
        """Raises a trigger or software source, which requests one firing from its processor."""
        with refusals:
            self.system._alive().request(self.name)

    def _instead(self, name: str) -> str:
        return "set it when you create the source" if name in vars(self) else ""

    def _called(self) -> str:
        return f"{self.kind} '{self.name}'"

    def __repr__(self) -> str:
        period = f" every {self.period:g} s" if self.kind == "timer" else ""
        return f"{self.kind} {self.name}{period}, priority {self.priority}"


def placement_json(placement: Mapping[Any, Any]) -> dict[str, str]:
    """Returns a placement, pattern → source, in the model's format."""
    placed: dict[str, str] = {}
    for pattern, source in placement.items():
        if not isinstance(source, Source):
            refuse(CallError, f"'{pattern}' must be placed on an interrupt source, not on {source!r}", "pass a source: rtp.timer(...)")
        placed[str(pattern)] = source.name
    return placed
