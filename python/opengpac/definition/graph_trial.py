# SPDX-License-Identifier: Apache-2.0
"""Runs a graph without a system: block after block, in the order of its data flow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import CallError, did_you_mean, refuse
from . import block_trial
from .graph_interface import item_of

if TYPE_CHECKING:
    from ..values.quantities import Quantity
    from .block_trial import Trial
    from .graphs import Graph


def _order(graph: Graph) -> list[str]:
    """Returns the labels in an order in which each writer precedes its readers."""
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
            _refuse_trial(graph, f"its blocks {rest} form a loop")
        ordered += ready
    return ordered


def _refuse_trial(graph: Graph, why: str) -> None:
    refuse(CallError, f"graph '{graph.name}' cannot be tried by itself: {why}", "run it in a verb of gpac.System('try', clock='virtual')")


def run(graph: Graph, steps: int | None, every: Quantity, given: Mapping[str, Any]) -> Trial:
    """Runs a trial as described in `Graph.run`. The blocks run one after another, each for all invocations, on the values that its
    predecessors produced."""
    ratio = next((p for p in (*graph.inputs.values(), *graph.outputs.values()) if p and str(p.item.mode).startswith("ratio")), None)
    if graph.divide or ratio is not None:
        _refuse_trial(graph, "its blocks run at several rates")
    values: dict[str, dict[str, Any]] = {label: dict(use.constants) for label, use in graph.blocks.items()}
    lengths: dict[str, int] = {}
    for name, value in given.items():
        label, _, inner = name.partition(".")
        if name in graph.inputs:
            length = block_trial._series(graph.inputs[name].item, value)[1]
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
        tried = graph.blocks[label].block._tried(times, every, values[label])
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
    return block_trial.Trial(graph.name, {"outputs": made, "conditions": sorted(conditions, key=lambda c: c[0]), "fault": fault})
