# SPDX-License-Identifier: Apache-2.0
"""Picture of a data flow graph: blocks with their ports, from left to right, and the wires between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ..definition.blocks import Block, BlockUse, Item
from .drawing import LINE, attribute, clip, rect, sheet, text, tooltip, wide, wire
from .layers import Box, Edge, Layers, layered
from .placing import Gaps, place, way

if TYPE_CHECKING:
    from ..definition.graphs import Graph

_IN = ("input", "device_read")
_OUT = ("output", "device_write")
_HEAD = 40.0
_PIN = 34.0


class _Port(NamedTuple):
    name: str
    item: Item
    mode: str
    """Mode of the port; empty for synchronous."""
    value: str
    """Text shown after the port's name if it has a constant, or uses its default."""

    def about(self) -> str:
        """Formats the type, unit and mode as a short text."""
        unit = f" {self.item.unit}" if self.item.unit else ""
        mode = f" {self.mode}" if self.mode else ""
        return f"{self.item.type}{unit}{mode}"


class _Drawn(NamedTuple):
    """A block of the graph with its size, ready for the layout."""

    label: str
    use: BlockUse
    takes: list[_Port]
    gives: list[_Port]
    notes: list[str]

    def size(self) -> tuple[float, float]:
        """Returns width and height."""
        left, right = (max((wide(p.name + p.value) + wide(p.about(), soft=True) + 8 for p in ps), default=0.0) for ps in self[2:4])
        head = max(wide(self.label), wide(self.kind(), soft=True))
        notes = max((wide(note, soft=True) for note in self.notes), default=0.0)
        height = _HEAD + LINE * (max(len(self.takes), len(self.gives)) + len(self.notes)) + 10
        return max(head + 24, left + right + 44, notes + 24), height

    def kind(self) -> str:
        """Returns the kind of the block."""
        return f"graph {self.use.block.name}" if not isinstance(self.use.block, Block) else self.use.block.name

    def at(self, port: str, ports: list[_Port]) -> float:
        """Returns the vertical offset of a port from the top of the block."""
        return _HEAD + 4 + LINE * (next(n for n, p in enumerate(ports) if p.name == port) + 0.5)


def item_of(block: Any, name: str) -> Item | None:
    """Returns the item to which a name of the graph refers: an item of a block, or of a block in a nested graph."""
    if isinstance(block, Block):
        return block.items.get(name)
    inner = block.items.get(name, [name])
    label, _, rest = inner[0].partition(".") if inner else ("", "", "")
    return item_of(block.blocks[label].block, rest) if label in block.blocks else None


def _items(block: Any) -> dict[str, Item]:
    found = {name: block.items[name] if isinstance(block, Block) else item_of(block, name) for name in block.items}
    return {name: item for name, item in found.items() if item is not None}


def _mode(item: Item, relaxed: Any) -> str:
    mode = item.mode if relaxed is None else relaxed if isinstance(relaxed, str) else f"ratio {relaxed['ratio']}"
    return "" if mode == "synchronous" else mode


def _drawn(graph: Graph, label: str, bound: set[str]) -> _Drawn:
    use = graph.blocks[label]
    items = _items(use.block)

    def port(name: str) -> _Port:
        value = f" = {_short(use.constants[name])}" if name in use.constants else ""
        loose = not value and f"{label}.{name}" not in bound and items[name].kind in _IN
        return _Port(name, items[name], _mode(items[name], graph.modes.get(f"{label}.{name}")), " = default" if loose else value)

    sides = [[port(name) for name, item in items.items() if item.kind in side] for side in (_IN, _OUT)]
    shown = {p.name for side in sides for p in side}
    notes = [f"{name} = {_short(value)}" for name, value in use.constants.items() if name not in shown]
    notes += [f"one in {graph.divide[label]} invocations"] if label in graph.divide else []
    notes += [f"of {clip(', '.join(use.block.blocks), 40)}"] if not isinstance(use.block, Block) else []
    return _Drawn(label, use, sides[0], sides[1], notes)


def _short(value: Any) -> str:
    return clip(repr(value.tolist() if hasattr(value, "tolist") else value), 24)


class _Wire(NamedTuple):
    """One connection between ports of blocks, or between a block's port and a port of the graph itself."""

    cell: str
    tail: str
    tail_port: str
    head: str
    head_port: str
    mode: str


def _pin(name: str, side: str) -> str:
    return f"{side} {name}"


def _wires(graph: Graph, drawn: dict[str, _Drawn]) -> list[_Wire]:
    found: list[_Wire] = []
    modes = {f"{label}.{p.name}": p.mode for label, d in drawn.items() for p in d.takes}
    gives = {f"{label}.{p.name}" for label, d in drawn.items() for p in d.gives}

    def split(port: str) -> tuple[str, str]:
        label, _, rest = port.partition(".")
        return label, rest

    for mapping, side in ((graph.inputs, "in"), (graph.cells, ""), (graph.outputs, "out")):
        for name, ports in mapping.items():
            sources = [split(p) for p in ports if p in gives]
            sinks = [(*split(p), modes[p]) for p in ports if p in modes]
            if side == "in" and sinks:
                sources = [(_pin(name, "in"), name)]
            if side == "out" or (side == "in" and not sinks):
                sinks.append((_pin(name, "out"), name, ""))
            found += [_Wire(name if not side else "", *source, *sink) for source in sources for sink in sinks]
    return found


def graph_svg(graph: Graph) -> str:
    """Returns the picture of a graph. Asynchronous wires are dashed, those with a ratio are dotted; feedback wires are routed around the
    blocks."""
    bound = {port for mapping in (graph.inputs, graph.cells, graph.outputs) for ports in mapping.values() for port in ports}
    drawn = {label: _drawn(graph, label, bound) for label in graph.blocks}
    wires = _wires(graph, drawn)
    pins = dict.fromkeys(end for w in wires for end in (w.tail, w.head) if end not in drawn)
    about = {pin: _pin_text(graph, pin) for pin in pins}
    boxes = [Box(pin, max(map(wide, about[pin])) + 22, _PIN, "first") for pin in pins if pin.startswith("in ")]
    boxes += [Box(label, *d.size()) for label, d in drawn.items()]
    boxes += [Box(pin, max(map(wide, about[pin])) + 22, _PIN, "last") for pin in pins if pin.startswith("out ")]
    edges = [Edge(w.tail, w.head, _leaves(drawn, w), _arrives(drawn, w)) for w in wires]
    layers = layered(boxes, edges)
    across = max([60.0, *(wide(clip(w.cell, 16), soft=True) + 34 for w in wires)])
    size = place(layers, Gaps(across=across))
    body = [_wire_drawn(layers, w, edge) for w, edge in zip(wires, edges, strict=True)]
    body += [_block_drawn(layers.boxes[label], d) for label, d in drawn.items()]
    body += [_pin_drawn(layers.boxes[pin], about[pin]) for pin in pins]
    return sheet(*size, body + _cells(layers, wires, edges), f"data flow graph {graph.name}")


def _leaves(drawn: dict[str, _Drawn], w: _Wire) -> float:
    return drawn[w.tail].at(w.tail_port, drawn[w.tail].gives) if w.tail in drawn else _PIN / 2


def _arrives(drawn: dict[str, _Drawn], w: _Wire) -> float:
    return drawn[w.head].at(w.head_port, drawn[w.head].takes) if w.head in drawn else _PIN / 2


def _pin_text(graph: Graph, pin: str) -> tuple[str, str]:
    name = pin.partition(" ")[2]
    item = item_of(graph, name)
    return name, "" if item is None else f"{item.type} {item.unit}".rstrip()


def _wire_drawn(layers: Layers, w: _Wire, edge: Edge) -> str:
    look = "asynchronous" if w.mode == "asynchronous" else "ratio" if w.mode else ""
    ends = [
        f"{end}.{port}" if not end.startswith(("in ", "out ")) else port for end, port in ((w.tail, w.tail_port), (w.head, w.head_port))
    ]
    words = f"{ends[0]} → {ends[1]}" + (f", cell {w.cell}" if w.cell else "") + (f", {w.mode}" if w.mode else "")
    return wire(way(layers, edge), look, words, attribute("wire", " ".join(ends)) + attribute("mode", w.mode or "synchronous"))


def _cells(layers: Layers, wires: list[_Wire], edges: list[Edge]) -> list[str]:
    """Returns the labels of the cells, one for each, next to the start of its wire."""
    named: dict[str, str] = {}
    for w, edge in zip(wires, edges, strict=True):
        if w.cell and w.cell not in named:
            tail = layers.boxes[w.tail]
            named[w.cell] = text(tail.x + tail.width + 8, tail.y + edge.tail_at - 8, clip(w.cell, 16), "soft")
    return [*named.values()]


def _pin_drawn(box: Box, about: tuple[str, str]) -> str:
    middle = box.x + box.width / 2
    lines = [text(middle, box.y + 10, about[0], "name", "middle"), text(middle, box.y + 24, about[1], "soft", "middle")]
    return f"<g{attribute('pin', box.name)}>{rect(box.x, box.y, box.width, box.height, 'pin', 14)}{''.join(lines)}</g>"


def _block_drawn(box: Box, d: _Drawn) -> str:
    nested = not isinstance(d.use.block, Block)
    look, head = ("graph", "graph-head") if nested else ("box", "head")
    parts = [rect(box.x + 4, box.y + 4, box.width, box.height, look)] if nested else []
    parts += [rect(box.x, box.y, box.width, box.height, look), rect(box.x + 1, box.y + 1, box.width - 2, _HEAD - 4, head, 4)]
    parts += [text(box.x + 10, box.y + 11, d.label, "name"), text(box.x + 10, box.y + 26, d.kind(), "soft")]
    for port in d.takes:
        y = box.y + d.at(port.name, d.takes)
        parts.append(f'<circle cx="{box.x:.1f}" cy="{y:.1f}" r="2.6" class="dot"/>')
        parts.append(text(box.x + 8, y, port.name + port.value))
        parts.append(text(box.x + 14 + wide(port.name + port.value), y, port.about(), "soft"))
    for port in d.gives:
        y, right = box.y + d.at(port.name, d.gives), box.x + box.width
        parts.append(f'<circle cx="{right:.1f}" cy="{y:.1f}" r="2.6" class="dot"/>')
        parts.append(text(right - 8, y, port.name, "", "end") + text(right - 14 - wide(port.name), y, port.about(), "soft", "end"))
    y = box.y + _HEAD + 4 + LINE * (max(len(d.takes), len(d.gives)) + 0.5)
    parts += [text(box.x + 10, y + LINE * n, note, "soft") for n, note in enumerate(d.notes)]
    return f"<g{attribute('block', d.label)}>{tooltip(d.use.block.doc)}{''.join(parts)}</g>"
