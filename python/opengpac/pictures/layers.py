# SPDX-License-Identifier: Apache-2.0
"""Layered layout, first phase: the layer of each box, and the order within each layer. Deterministic: ties are broken by the order of
declaration."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

_SWEEPS = 12


@dataclass
class Box:
    """A box of known size for the layout. `rank` forces it into the first or the last layer."""

    name: str
    width: float
    height: float
    rank: str = ""
    layer: int = 0
    x: float = 0.0
    y: float = 0.0


@dataclass
class Edge:
    """An edge between boxes; `tail_at` and `head_at` are the distances of its ends below the tops of the boxes."""

    tail: str
    head: str
    tail_at: float
    head_at: float
    back: bool = False
    """True for an edge against the direction of the layers, which closes a cycle."""
    lanes: list[str] = field(default_factory=list)
    """Lanes between other boxes through which the edge passes, in its own direction, as names of zero-width boxes."""


@dataclass
class Layers:
    """Boxes in their layers, with a lane for each layer that an edge crosses."""

    boxes: dict[str, Box]
    edges: list[Edge]
    order: list[list[str]]

    def pieces(self) -> list[tuple[str, float, str, float]]:
        """Returns each edge as segments between stations, in its own direction: (station, at, station, at)."""
        found: list[tuple[str, float, str, float]] = []
        for edge in self.edges:
            stations = [(edge.tail, edge.tail_at), *((lane, 0.0) for lane in edge.lanes), (edge.head, edge.head_at)]
            found += [(*a, *b) for a, b in itertools.pairwise(stations)]
        return found


def layered(boxes: Iterable[Box], edges: Iterable[Edge]) -> Layers:
    """Assigns boxes to layers and orders them so that edges lead forward and few of them cross."""
    known = {box.name: box for box in boxes}
    given = list(edges)
    _turn(known, given)
    _rank(known, given)
    layers = Layers(known, given, [])
    _lay_lanes(layers)
    count = max((box.layer for box in known.values()), default=-1) + 1
    layers.order = [[name for name, box in known.items() if box.layer == layer] for layer in range(count)]
    _untangle(layers)
    return layers


def _turn(boxes: Mapping[str, Box], edges: list[Edge]) -> None:
    """Marks the edges that close a cycle, found by depth-first search from boxes without incoming edges."""
    out: dict[str, list[Edge]] = {name: [] for name in boxes}
    for edge in edges:
        out[edge.tail].append(edge)
    entered = {edge.head for edge in edges}
    seen: set[str] = set()
    roots = [name for name in boxes if name not in entered] + [*boxes]
    for root in roots:
        if root in seen:
            continue
        seen.add(root)
        open_, stack = {root}, [(root, iter(out[root]))]
        while stack:
            name, left = stack[-1]
            edge = next(left, None)
            if edge is None:
                open_.discard(name)
                stack.pop()
            elif edge.head in open_:
                edge.back = True
            elif edge.head not in seen:
                seen.add(edge.head)
                open_.add(edge.head)
                stack.append((edge.head, iter(out[edge.head])))


def _rank(boxes: Mapping[str, Box], edges: list[Edge]) -> None:
    """Ranks the boxes by longest path; a box without inputs is placed directly before the first box that it feeds."""
    forward = [edge for edge in edges if not edge.back]
    least = 1 if any(box.rank == "first" for box in boxes.values()) else 0
    for box in boxes.values():
        box.layer = 0 if box.rank == "first" else least
    for _ in boxes:
        moved = [e for e in forward if boxes[e.head].layer <= boxes[e.tail].layer]
        for edge in moved:
            boxes[edge.head].layer = boxes[edge.tail].layer + 1
        if not moved:
            break
    fed = {edge.head for edge in edges}
    for box in boxes.values():
        after = [boxes[edge.head].layer for edge in forward if edge.tail == box.name]
        if box.name not in fed and box.rank == "" and after:
            box.layer = max(least, min(after) - 1)
    inner = [box.layer for box in boxes.values() if box.rank != "last"]
    for box in boxes.values():
        if box.rank == "last":
            box.layer = max(inner, default=-1) + 1


def _lay_lanes(layers: Layers) -> None:
    """Creates the lanes. A forward edge has one in each layer between its ends; a backward edge also has one in the layers of its ends."""
    for number, edge in enumerate(layers.edges):
        tail, head = layers.boxes[edge.tail].layer, layers.boxes[edge.head].layer
        passed = range(tail, head - 1, -1) if edge.back else range(tail + 1, head)
        for layer in passed:
            name = f"\0{number}.{layer}"
            layers.boxes[name] = Box(name, 0.0, 0.0, layer=layer)
            edge.lanes.append(name)


def _untangle(layers: Layers) -> None:
    """Sweeps through the layers, ordering each by the mean positions of its neighbours; keeps the best order."""
    near: dict[str, list[tuple[str, float]]] = {name: [] for name in layers.boxes}
    for a, at_a, b, at_b in layers.pieces():
        near[a].append((b, at_b))
        near[b].append((a, at_a))
    best, fewest = [list(layer) for layer in layers.order], _crossings(layers)
    for sweep in range(_SWEEPS):
        down = sweep % 2 == 0
        places = range(len(layers.order)) if down else range(len(layers.order) - 1, -1, -1)
        for place in places:
            _sort(layers, place, near, down)
        crossings = _crossings(layers)
        if crossings < fewest:
            best, fewest = [list(layer) for layer in layers.order], crossings
    layers.order = best


def _sort(layers: Layers, place: int, near: Mapping[str, list[tuple[str, float]]], down: bool) -> None:
    position = _positions(layers)
    others = place - 1 if down else place + 1

    def mean(name: str) -> float:
        found = [position[other] + at * 1e-4 for other, at in near[name] if layers.boxes[other].layer in (others, place)]
        return sum(found) / len(found) if found else position[name]

    layers.order[place] = sorted(layers.order[place], key=lambda name: (mean(name), position[name]))


def _positions(layers: Layers) -> dict[str, float]:
    return {name: (at + 0.5) / len(layer) for layer in layers.order for at, name in enumerate(layer)}


def _crossings(layers: Layers) -> int:
    position = _positions(layers)
    between: dict[int, list[tuple[float, float]]] = {}
    for a, at_a, b, at_b in layers.pieces():
        left, right = (layers.boxes[a].layer, layers.boxes[b].layer)
        if left == right:
            continue
        ends = (position[a] + at_a * 1e-4, position[b] + at_b * 1e-4)
        between.setdefault(min(left, right), []).append(ends if left < right else (ends[1], ends[0]))
    return sum((a[0] - b[0]) * (a[1] - b[1]) < 0 for pieces in between.values() for n, a in enumerate(pieces) for b in pieces[:n])
