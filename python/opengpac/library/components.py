# SPDX-License-Identifier: Apache-2.0
"""Contents of the component data base: components, search results, and problems."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal, NamedTuple

from ..definition.blocks import Block, Item
from ..definition.graphs import Graph
from ..definition.verbs import Verb
from ..devices.logical import LogicalDevice
from ..values.tables import Table, TableDisplay

Kind = Literal["block", "graph", "verb", "device type"]


@dataclass(frozen=True)
class Component:
    """One entry of the database: `name` for requests, `kind`, `category`, `origin`, `doc`, and the object itself, `value`."""

    name: str
    kind: Kind
    category: str
    origin: str
    doc: str
    value: Any
    source: str = ""
    """File that defines the component."""

    @property
    def title(self) -> str:
        """First line of the documentation; for a block, its equation."""
        return self.doc.strip().splitlines()[0] if self.doc.strip() else ""

    @property
    def short_name(self) -> str:
        """Last word of the name: `move` for `robots.move`."""
        return self.name.rsplit(".", 1)[-1]

    @property
    def names(self) -> tuple[str, ...]:
        """All names by which the component can be requested, shortest first."""
        own = self.value.name if self.kind != "device type" else self.value.definition_name()
        return tuple(dict.fromkeys((self.short_name, self.name, own)))

    @property
    def where(self) -> str:
        """Description of the origin for messages: `library`, or the origin and the file."""
        return self.origin if self.origin == "library" or not self.source else f"{self.origin} ({self.source})"

    @property
    def items(self) -> dict[str, str]:
        """Ports, parameters, conditions and members with their descriptions."""
        if self.kind == "block":
            return {name: item.doc for name, item in self.value.items.items()}
        if self.kind == "graph":
            return dict.fromkeys(self.value.items, "")
        if self.kind == "verb":
            return dict.fromkeys((*self.value.signature.parameters, *self.value.output_values, *self.value.conditions), "")
        return dict.fromkeys((*self.value.svv_members(), *self.value.parameter_members()), "")

    def __repr__(self) -> str:
        return f"{self.name:<24} {self.kind:<11} {self.title}"


class Problem(NamedTuple):
    """A component that is missing from the database: its description, and the reason."""

    what: str
    reason: str

    def __str__(self) -> str:
        return f"{self.what}: {self.reason}"


class Found(tuple[Component, ...], TableDisplay):
    """Ordered components, printed as a table, also in a notebook."""

    __slots__ = ()

    def __repr__(self) -> str:
        return "\n".join(repr(component) for component in self) or "nothing"

    def _table(self) -> Table:
        return Table("", ["name", "kind", "category", "description"], [(c.name, c.kind, c.category, c.title) for c in self])


def block_component(block: Block, category: str, origin: str, source: str = "") -> Component:
    """Returns the entry of a block; the names of blocks of other origins include the origin."""
    short = block.name.split(".", 1)[1]
    return Component(short if origin == "library" else f"{origin}.{short}", "block", category, origin, block.doc, block, source)


def members(module: ModuleType, prefix: str, origin: str) -> list[Component]:
    """Returns the public graphs, verbs and device types of a Python module."""
    public: Iterable[str] = getattr(module, "__all__", [name for name in vars(module) if not name.startswith("_")])
    found: list[Component] = []
    for name in public:
        value = getattr(module, name, None)
        kind: Kind
        if isinstance(value, Verb):
            kind, doc = "verb", value.doc
        elif isinstance(value, Graph):
            kind, doc = "graph", value.doc
        elif isinstance(value, type) and issubclass(value, LogicalDevice) and value is not LogicalDevice:
            kind, doc = "device type", inspect.getdoc(value) or ""
        else:
            continue
        found.append(Component(f"{prefix}.{name}", kind, prefix, origin, doc, value, getattr(module, "__file__", "") or ""))
    return found


def items_of(block: Block) -> Mapping[str, Item]:
    """Returns the items of a block that are visible to its user, excluding its state."""
    return {name: item for name, item in block.items.items() if item.kind != "state"}
