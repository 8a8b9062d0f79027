# SPDX-License-Identifier: Apache-2.0
"""Takeover by a new supervisor from one that was lost: the result of `System.take_over`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class TakenProcessor:
    """Result for one processor in a separate process, or for the processors that share one.

    `name` is the name of the processor or of the shared process; `processors` are the processors in it. `adopted` is True if the
    process had lost its system and its verbs continue there; otherwise the process was started for this system. `carried` are the
    blocks that continue (`instance.block`), `anew` those that restart, each with the reason, and `ended` those that were running and
    that this system has not started. `gap` is the longest time for which a device was not written, in s; None if there was no gap.
    """

    name: str
    adopted: bool
    carried: tuple[str, ...] = ()
    anew: Mapping[str, str] = field(default_factory=dict)
    ended: tuple[str, ...] = ()
    gap: float | None = None
    processors: tuple[str, ...] = ()

    def __str__(self) -> str:
        shared = self.name not in self.processors
        of = f"process '{self.name}' (processors {', '.join(map(repr, self.processors))})" if shared else f"processor '{self.name}'"
        if not self.adopted:
            return f"{of}: {'it' if shared else 'its process'} was started for this system"
        gap = "" if self.gap is None else f"; outputs held for {self.gap * 1e3:.3g} ms"
        lines = [f"{of}: {len(self.carried)} blocks continue{gap}"]
        lines += [f"  {block} starts from its initial state: {why}" for block, why in self.anew.items()]
        lines += [f"  {block} has ended and was not restarted" for block in self.ended]
        return "\n".join(lines)


@dataclass(frozen=True)
class TakenOver:
    """Result of `System.take_over`, for each process of processors. Printed as text."""

    processors: tuple[TakenProcessor, ...]

    @property
    def adopted(self) -> tuple[str, ...]:
        """Names of the processors whose processes were taken over."""
        return tuple(name for of in self.processors if of.adopted for name in of.processors)

    def __getitem__(self, name: str) -> TakenProcessor:
        """Returns the result for the processor with that name and for those that share its process."""
        for of in self.processors:
            if name in (of.name, *of.processors):
                return of
        there = ", ".join(name for of in self.processors for name in of.processors)
        raise KeyError(f"'{name}' is not a processor in a separate process{f'; choose one of {there}' if there else ''}")

    def __str__(self) -> str:
        return "\n".join(str(of) for of in self.processors) or "there is nothing to take over: no processor runs in a separate process"


def taken_over(answer: Mapping[str, Any]) -> TakenOver:
    """Converts the answer of the call to an object."""
    return TakenOver(
        tuple(
            TakenProcessor(
                name=of["name"],
                adopted=of["is_adopted"],
                carried=tuple(of["carried"]),
                anew={block["block"]: block["why"] for block in of["anew"]},
                ended=tuple(of["ended"]),
                gap=None if of["gap_ns"] is None else of["gap_ns"] * 1e-9,
                processors=tuple(of["processors"]),
            )
            for of in answer["processors"]
        )
    )
