# SPDX-License-Identifier: Apache-2.0
"""Listings of what a system has: verbs of both classes, simple and composed, and the instances of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from ..values.tables import Table, TableDisplay


class VerbEntry(NamedTuple):
    """A verb that was entered in a system."""

    name: str
    supports: tuple[str, ...]
    """The device types that it keeps going; empty: it acts on devices."""
    simple: bool
    """Whether it has one command list only."""
    parts: Mapping[str, str]
    """The parts of a composed verb: label → the verb that it was made from; with those of the parts, `pick.grasp`."""
    command_lists: tuple[str, ...]
    doc: str

    @property
    def kind(self) -> str:
        """`supports devices` (a servo), or `acts on devices`."""
        return "supports devices" if self.supports else "acts on devices"

    @property
    def columns(self) -> tuple[str, ...]:
        """Returns the headings of its line."""
        return ("verb", "kind", "shape", "what it is for")

    def row(self) -> tuple[str, ...]:
        """Its line of the listing."""
        parts = ", ".join(label for label in self.parts if "." not in label)
        shape = ["composed of " + parts] if parts else []
        shape += ["simple"] if self.simple else [f"{len(self.command_lists)} command lists"]
        kind = f"supports {', '.join(self.supports)}" if self.supports else self.kind
        return (self.name, kind, ", ".join(shape), self.doc.strip().split("\n", 1)[0])


class InstanceEntry(NamedTuple):
    """A verb instance that exists."""

    name: str
    verb: str
    state: str
    command_list: str
    device: str | None
    """The logical device that it keeps going; None: it acts on devices."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Returns the headings of its line."""
        return ("instance", "state", "list", "what it does")

    def row(self) -> tuple[str, ...]:
        """Its line of the listing."""
        return (self.name, self.state, self.command_list, f"supports {self.device}" if self.device else "acts on devices")


E = TypeVar("E", VerbEntry, InstanceEntry)


class Listing(list[E], TableDisplay):
    """Entries, which print as a table."""

    def _table(self) -> Table:
        return Table("", self[0].columns if self else [], [entry.row() for entry in self])

    def __repr__(self) -> str:
        rows = [entry.row() for entry in self]
        wide = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
        return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, wide, strict=True)).rstrip() for row in rows)


def verbs_of(given: list[dict[str, Any]]) -> Listing[VerbEntry]:
    """The verbs that the real-time system tells."""
    return Listing(
        VerbEntry(
            v["name"], tuple(v["supports"]), v["simple"], {p: of["verb"] for p, of in v["parts"].items()}, tuple(v["lists"]), v["doc"]
        )
        for v in given
    )


def instances_of(given: list[dict[str, Any]]) -> Listing[InstanceEntry]:
    """The instances that the real-time system tells."""
    return Listing(InstanceEntry(i["name"], i["verb"], i["state"], i["list"], i["owner"]) for i in given)
