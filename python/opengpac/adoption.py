# SPDX-License-Identifier: Apache-2.0
"""What a new supervisor took over from one that was lost: the answer of `System.take_over`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class TakenProcessor:
    """What became of one processor in a process of its own.

    `adopted`: its process had lost its system, and what ran there goes on; else it was started for this system. `carried` are the
    blocks that go on where they were (`instance.block`), `anew` those that begin anew, each with the reason, `ended` those that ran
    and that this system has not started. `gap` is the longest time for which a device was not written, in s; None where none was.
    """

    name: str
    adopted: bool
    carried: tuple[str, ...] = ()
    anew: Mapping[str, str] = field(default_factory=dict)
    ended: tuple[str, ...] = ()
    gap: float | None = None

    def __str__(self) -> str:
        if not self.adopted:
            return f"processor '{self.name}': its process was started for this system"
        gap = "" if self.gap is None else f"; outputs held for {self.gap * 1e3:.3g} ms"
        lines = [f"processor '{self.name}': {len(self.carried)} blocks go on{gap}"]
        lines += [f"  {block} begins anew: {why}" for block, why in self.anew.items()]
        lines += [f"  {block} has ended: it was not started again" for block in self.ended]
        return "\n".join(lines)


@dataclass(frozen=True)
class TakenOver:
    """What `System.take_over` did, for each processor in a process of its own; it prints as a text."""

    processors: tuple[TakenProcessor, ...]

    @property
    def adopted(self) -> tuple[str, ...]:
        """The names of the processors whose processes were taken over."""
        return tuple(of.name for of in self.processors if of.adopted)

    def __getitem__(self, name: str) -> TakenProcessor:
        """What became of the processor of that name."""
        for of in self.processors:
            if of.name == name:
                return of
        raise KeyError(f"no processor '{name}' in a process of its own; there are {', '.join(of.name for of in self.processors) or 'none'}")

    def __str__(self) -> str:
        return "\n".join(str(of) for of in self.processors) or "there was nothing to take over: no processor has a process of its own"


def taken_over(text: str) -> TakenOver:
    """The answer from its JSON."""
    return TakenOver(
        tuple(
            TakenProcessor(
                name=of["name"],
                adopted=of["is_adopted"],
                carried=tuple(of["carried"]),
                anew={block["block"]: block["why"] for block in of["anew"]},
                ended=tuple(of["ended"]),
                gap=None if of["gap_ns"] is None else of["gap_ns"] * 1e-9,
            )
            for of in json.loads(text)["processors"]
        )
    )
