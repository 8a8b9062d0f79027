# SPDX-License-Identifier: Apache-2.0
"""Listings of a system's verbs, simple and composed, of both classes, and of their instances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from ..values.tables import Table, TableDisplay


class VerbEntry(NamedTuple):
    """A verb registered in a system."""

    name: str
    supports: tuple[str, ...]
    """Device types that the verb keeps running; empty if it acts on devices."""
    simple: bool
    """True if the verb has a single command list."""
    parts: Mapping[str, str]
    """Parts of a composed verb: label → original verb, including nested parts, `pick.grasp`."""
    command_lists: tuple[str, ...]
    doc: str

    @property
    def kind(self) -> str:
        """Kind: `supports devices` (a servo), or `acts on devices`."""
        return "supports devices" if self.supports else "acts on devices"

    @property
    def columns(self) -> tuple[str, ...]:
        """Returns the column headings of the entry."""
        return ("verb", "kind", "shape", "description")

    def row(self) -> tuple[str, ...]:
        """Returns the entry as a row of the listing."""
        parts = ", ".join(label for label in self.parts if "." not in label)
        shape = ["composed of " + parts] if parts else []
        shape += ["simple"] if self.simple else [f"{len(self.command_lists)} command lists"]
        kind = f"supports {', '.join(self.supports)}" if self.supports else self.kind
        return (self.name, kind, ", ".join(shape), self.doc.strip().split("\n", 1)[0])


class InstanceEntry(NamedTuple):
    """A verb instance that exists in a system."""

    name: str
    verb: str
    state: str
    command_list: str
    device: str | None
    """Logical device that the instance keeps running; None if it acts on devices."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Returns the column headings of the entry."""
        return ("instance", "state", "list", "description")

    def row(self) -> tuple[str, ...]:
        """Returns the entry as a row of the listing."""
        return (self.name, self.state, self.command_list, f"supports {self.device}" if self.device else "acts on devices")


E = TypeVar("E", VerbEntry, InstanceEntry)


class Listing(list[E], TableDisplay):
    """Entries, printed as a table."""

    def _table(self) -> Table:
        return Table("", self[0].columns if self else [], [entry.row() for entry in self])

    def __repr__(self) -> str:
        rows = [entry.row() for entry in self]
        wide = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
        return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, wide, strict=True)).rstrip() for row in rows)


def verbs_of(given: list[dict[str, Any]]) -> Listing[VerbEntry]:
    """Returns the verbs reported by the real-time system."""
    return Listing(
        VerbEntry(
            v["name"], tuple(v["supports"]), v["simple"], {p: of["verb"] for p, of in v["parts"].items()}, tuple(v["lists"]), v["doc"]
        )
        for v in given
    )


def instances_of(given: list[dict[str, Any]]) -> Listing[InstanceEntry]:
    """Returns the instances reported by the real-time system."""
    return Listing(InstanceEntry(i["name"], i["verb"], i["state"], i["list"], i["owner"]) for i in given)
