# SPDX-License-Identifier: Apache-2.0
"""What a graph shows of itself, as a subroutine does: ports with types and modes, devices, conditions, parameters, and a trial."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from .blocks import Block, Item
from .errors import CallError, did_you_mean, refuse

if TYPE_CHECKING:
    from .graphs import Graph
    from .quantities import Quantity
    from .trial import Trial

_SHOWN = ("kind", "mode", "type", "unit", "doc", "has_default", "sized", "least", "most", "initial", "history")


class GraphPort(list[str]):
    """A port of a graph: the ports of its blocks that it covers. `kind`, `mode`, `type`, `unit`, `doc` and the rest of an item are those of
    the output among them, else those of the first input, with the mode that the graph gives it."""

    def __init__(self, graph: Graph, name: str, ports: Iterable[str]) -> None:
        super().__init__(ports)
        self.graph = graph
        self.name = name

    @property
    def item(self) -> Item:
        """What it is, as a block's port would say it."""
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


def item_of(graph: Graph, port: str) -> Item:
    """The item that a name within a graph stands for, `filter.u`, with the mode that the graph gives it."""
    label, _, name = port.partition(".")
    inner = graph.blocks[label].block
    if isinstance(inner, Block):
        item = inner.items[name]
    else:
        item = ports[name].item if name in (ports := {**inner.inputs, **inner.outputs}) else item_of(inner, name)
    return _renamed(item, item.name, graph.modes.get(port))


def items_of(graph: Graph, kind: str) -> dict[str, Item]:
    """The devices, conditions or parameters of all blocks of a graph, by their names from outside: `filter.alpha`."""
    found: dict[str, Item] = {}
    for label, use in graph.blocks.items():
        inner: Mapping[str, Item] = getattr(use.block, kind)
        found.update({f"{label}.{name}": _renamed(item, f"{label}.{name}") for name, item in inner.items()})
    return found


def _order(graph: Graph) -> list[str]:
    """Labels so that what writes comes before what reads."""
    after: dict[str, set[str]] = {label: set() for label in graph.blocks}
    for ports in (*graph.cells.values(), *graph.outputs.values()):
        writers = {p.split(".")[0] for p in ports if item_of(graph, p).kind == "output"}
        for port in ports:
            if item_of(graph, port).kind == "input":
                after[port.split(".")[0]] |= writers
    ordered: list[str] = []
    while len(ordered) < len(after):
        ready = [label for label, before in after.items() if label not in ordered and before <= {*ordered}]
        if not ready:
            rest = ", ".join(f"'{label}'" for label in after if label not in ordered)
            _refuse_trial(graph, f"its blocks {rest} read what they write themselves")
        ordered += ready
    return ordered


def _refuse_trial(graph: Graph, why: str) -> None:
    refuse(CallError, f"graph '{graph.name}' cannot be tried by itself: {why}", "run it in a verb of gpac.System('try', clock='virtual')")


def run(graph: Graph, steps: int | None, every: Quantity, given: Mapping[str, Any]) -> Trial:
    """As `Graph.run` says: block after block, each with all values of those before it."""
    from . import trial

    ratio = next((p for p in (*graph.inputs.values(), *graph.outputs.values()) if p and str(p.item.mode).startswith("ratio")), None)
    if graph.divide or ratio is not None:
        _refuse_trial(graph, "its blocks run at several rates")
    values: dict[str, dict[str, Any]] = {label: dict(use.constants) for label, use in graph.blocks.items()}
    lengths: dict[str, int] = {}
    for name, value in given.items():
        label, _, inner = name.partition(".")
        if name in graph.inputs:
            length = trial._series(graph.inputs[name].item, value)[1]
            if length:
                lengths[name] = length
            for port in graph.inputs[name]:
                values[port.split(".")[0]][port.split(".", 1)[1]] = value
        elif inner and label in values:
            values[label][inner] = value
        else:
            known = [*graph.inputs, *graph.parameters]
            refuse(CallError, f"graph '{graph.name}' has no input or parameter '{name}'", did_you_mean(name, known))
    times = steps if steps is not None else min(lengths.values(), default=1)
    made: dict[str, Any] = {}
    conditions: list[Any] = []
    fault: Any = None
    for label in _order(graph):
        tried = trial.try_one(graph.blocks[label].block, times, every, values[label])
        conditions += [(at, f"{label}.{name}", value) for at, name, value in tried.conditions]
        if tried.fault is not None:
            fault = tried.fault
            break
        for name, ports in (*graph.cells.items(), *graph.outputs.items()):
            written = next((p for p in ports if p.split(".")[0] == label and item_of(graph, p).kind == "output"), None)
            if written is None:
                continue
            series = tried.outputs[written.split(".", 1)[1]]
            if name in graph.outputs:
                made[name] = series
            for port in ports:
                if port != written:
                    values[port.split(".")[0]][port.split(".", 1)[1]] = series
    return trial.Trial(graph.name, {"outputs": made, "conditions": sorted(conditions, key=lambda c: c[0]), "fault": fault})
