# SPDX-License-Identifier: Apache-2.0
"""Layered layout, second phase: the position of each box and lane, and the path of each edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .layers import Box, Edge, Layers

_PASSES = 16


@dataclass(frozen=True)
class Gaps:
    """Spacing between layers, between boxes of a layer, and next to a lane."""

    across: float = 56.0
    down: float = 22.0
    lane: float = 12.0


def place(layers: Layers, gaps: Gaps) -> tuple[float, float]:
    """Sets the x and y of every box, starting at (0, 0); returns the size of the picture."""
    x = 0.0
    for layer in layers.order:
        wide = max((layers.boxes[name].width for name in layer), default=0.0)
        for name in layer:
            box = layers.boxes[name]
            box.x = x + (wide - box.width) / 2 if box.width else x
            if not box.width:
                box.width = wide
        x += wide + gaps.across
    _stack(layers, gaps)
    top = min((box.y for box in layers.boxes.values()), default=0.0)
    for box in layers.boxes.values():
        box.y -= top
    return max(x - gaps.across, 0.0), max((box.y + box.height for box in layers.boxes.values()), default=0.0)


def _stack(layers: Layers, gaps: Gaps) -> None:
    """Iteratively moves the boxes of each layer as close as their order allows to the positions that make the edges straight."""
    for layer in layers.order:
        offsets = _offsets(layers, layer, gaps)
        for name, offset in zip(layer, offsets, strict=True):
            layers.boxes[name].y = offset - offsets[-1] / 2
    near: dict[str, list[tuple[str, float, float]]] = {name: [] for name in layers.boxes}
    for a, at_a, b, at_b in layers.pieces():
        if layers.boxes[a].layer != layers.boxes[b].layer:
            # Pieces between two lanes have double weight, to keep long edges straight.
            weight = 2.0 if a.startswith("\0") and b.startswith("\0") else 1.0
            near[a].append((b, at_b - at_a, weight))
            near[b].append((a, at_a - at_b, weight))
        else:
            # An edge that turns around stays close.
            near[b if b.startswith("\0") else a].append((a if b.startswith("\0") else b, 0.0, 0.3))
    for sweep in range(_PASSES):
        for layer in layers.order if sweep % 2 == 0 else layers.order[::-1]:
            wanted = [_wanted(layers, name, near[name]) for name in layer]
            for name, y in zip(layer, _nearest(wanted, _offsets(layers, layer, gaps)), strict=True):
                layers.boxes[name].y = y


def _wanted(layers: Layers, name: str, near: Sequence[tuple[str, float, float]]) -> float:
    total = sum(weight for _, _, weight in near)
    return sum((layers.boxes[other].y + at) * weight for other, at, weight in near) / total if total else layers.boxes[name].y


def _offsets(layers: Layers, layer: Sequence[str], gaps: Gaps) -> list[float]:
    """Returns the minimum distance of each box from the first box of its layer."""
    offsets, at, last = [], 0.0, None
    for name in layer:
        box = layers.boxes[name]
        if last is not None:
            at += last.height + (gaps.down if last.height and box.height else gaps.lane)
        offsets.append(at)
        last = box
    return offsets


def _nearest(wanted: Sequence[float], offsets: Sequence[float]) -> list[float]:
    """Returns the positions closest to `wanted`, in the least-squares sense, that respect the minimum distances: neighbours that would
    overlap become one block at the mean of its members."""
    blocks: list[tuple[float, int]] = []
    for want, offset in zip(wanted, offsets, strict=True):
        mean, count = want - offset, 1
        while blocks and blocks[-1][0] >= mean:
            before, size = blocks.pop()
            mean, count = (before * size + mean * count) / (size + count), size + count
        blocks.append((mean, count))
    starts = [mean for mean, count in blocks for _ in range(count)]
    return [start + offset for start, offset in zip(starts, offsets, strict=True)]


def way(layers: Layers, edge: Edge) -> str:
    """Returns the SVG path of an edge: straight along its lanes, curved between the layers."""
    tail, head = layers.boxes[edge.tail], layers.boxes[edge.head]
    x, y = tail.x + tail.width, tail.y + edge.tail_at
    path = f"M{x:.1f} {y:.1f}"
    for name in edge.lanes:
        lane = layers.boxes[name]
        enter, leave = (lane.x + lane.width, lane.x) if edge.back else (lane.x, lane.x + lane.width)
        path += _curve(x, y, enter, lane.y, -1 if edge.back else 1, first=x == tail.x + tail.width and y == tail.y + edge.tail_at)
        path += f" L{leave:.1f} {lane.y:.1f}"
        x, y = leave, lane.y
    return path + _into(x, y, head, edge)


def _curve(x: float, y: float, to_x: float, to_y: float, way: int, first: bool) -> str:
    """Returns the curve between two stations. It leaves and enters a box from left to right, and a lane in the direction of its edge."""
    bend = max(abs(to_x - x) / 2, 22.0)
    leave = bend if first else way * bend
    return f" C{x + leave:.1f} {y:.1f} {to_x - way * bend:.1f} {to_y:.1f} {to_x:.1f} {to_y:.1f}"


def _into(x: float, y: float, head: Box, edge: Edge) -> str:
    to_x, to_y = head.x, head.y + edge.head_at
    bend = max(abs(to_x - x) / 2, 22.0)
    leave = -bend if edge.back else bend
    return f" C{x + leave:.1f} {y:.1f} {to_x - bend:.1f} {to_y:.1f} {to_x:.1f} {to_y:.1f}"
