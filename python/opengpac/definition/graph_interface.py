# SPDX-License-Identifier: Apache-2.0
"""Interface of a graph, like that of a subroutine: ports with types and modes, devices, conditions, parameters."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from .blocks import Block, Item

if TYPE_CHECKING:
    from .graphs import Graph

_SHOWN = ("kind", "mode", "type", "unit", "range", "doc", "has_default", "sized", "least", "most", "initial", "history")


class GraphPort(list[str]):
    """A port of a graph, as the list of the block ports that it covers. `kind`, `mode`, `type`, `unit`, `doc` and other attributes are
    those of the output in the list, or, if there is none, those of the first input, with the mode that the graph assigns."""

    def __init__(self, graph: Graph, name: str, ports: Iterable[str]) -> None:
        super().__init__(ports)
        self.graph = graph
        self.name = name

    @property
    def item(self) -> Item:
        """Item of the port, as for a block's port."""
        found = [item_of(self.graph, port) for port in self]
        first = next((item for item in found if item.kind == "output"), found[0])
        return _renamed(first, self.name, self.graph.modes.get(self.name))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name in ("graph", "name"):
            raise AttributeError(name)  # while it is copied
        if name in _SHOWN and self:
            return getattr(self.item, name)
        raise AttributeError(f"port '{self.name}' of graph '{self.graph.name}' has no '{name}'")

    def __repr__(self) -> str:
        return list.__repr__(self)


def _renamed(item: Item, name: str, mode: Any = None) -> Item:
    new = copy.copy(item)
    new.name = name
    if mode is not None:
        new.mode = mode if isinstance(mode, str) else f"ratio {mode['ratio']}"
    return new


def _element(whole: Item, name: str) -> Item:
    """Returns the item for an element of an array port."""
    element = _renamed(whole, name)
    element.type, element.sized, element.has_default, element.initial = whole.type.partition("[")[0], False, False, b""
    return element


def item_of(graph: Graph, port: str) -> Item:
    """Returns the item for a name within a graph, `filter.u`, with the mode that the graph assigns."""
    label, _, name = port.partition(".")
    inner = graph.blocks[label].block
    of, bracket, _ = name.partition("[")
    if bracket and name.endswith("]"):
        return _element(item_of(graph, f"{label}.{of}"), name)
    if isinstance(inner, Block):
        item = inner.items[name]
    else:
        item = ports[name].item if name in (ports := {**inner.inputs, **inner.outputs}) else item_of(inner, name)
    return _renamed(item, item.name, graph.modes.get(port))


def items_of(graph: Graph, kind: str) -> dict[str, Item]:
    """Returns the devices, conditions or parameters of all blocks of a graph, by their external names: `filter.alpha`."""
    found: dict[str, Item] = {}
    for label, use in graph.blocks.items():
        inner: Mapping[str, Item] = getattr(use.block, kind)
        found.update({f"{label}.{name}": _renamed(item, f"{label}.{name}") for name, item in inner.items()})
    return found
