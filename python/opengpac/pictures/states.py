# SPDX-License-Identifier: Apache-2.0
"""Picture of a verb: its command lists as states, its transitions, and the ends to which its conditions lead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ..values.quantities import duration_text
from .drawing import LINE, attribute, clip, rect, sheet, text, tooltip, wide, wire
from .layers import Box, Edge, Layers, layered
from .placing import Gaps, place, way

if TYPE_CHECKING:
    from ..definition.verbs import Verb

_HEAD = 26.0
_START = "\0start"
_LONGEST = 46


class _Change(NamedTuple):
    """Transition from a list to a list or an end, by these conditions."""

    tail: str
    head: str
    conditions: list[str]


def verb_svg(verb: Verb[..., Any]) -> str:
    """Returns the picture of a verb. A dot marks the initial list; ends that raise an exception are red."""
    changes, ends = _changes(verb)
    lists = {name: [clip(command_text(c), _LONGEST) for c in commands] for name, commands in verb.command_lists.items()}
    boxes = [Box(_START, 12, 12, "first")]
    boxes += [Box(_state(name), *_state_size(_title(verb, name), lines)) for name, lines in lists.items()]
    boxes += [Box(end, wide(clip(end, _LONGEST)) + 24, 28, "last") for end in ends]
    edges = [Edge(_START, _state(first), 6, _HEAD / 2) for first in [verb.initial or next(iter(lists), None)] if first in lists]
    labels: list[tuple[str, _Change]] = []
    for number, change in enumerate(changes):
        label = f"label {number}"
        height = LINE * len(change.conditions)
        boxes.append(Box(label, max(map(wide, change.conditions)) + 10, height))
        labels.append((label, change))
        edges.append(Edge(change.tail, label, _middle(boxes, change.tail), height / 2))
        edges.append(Edge(label, change.head, height / 2, _middle(boxes, change.head)))
    layers = layered(boxes, edges)
    size = place(layers, Gaps(across=30.0, down=18.0))
    body = [_edge_drawn(layers, edge, labels) for edge in edges]
    body += [_state_drawn(layers.boxes[_state(name)], _title(verb, name), name, lines) for name, lines in lists.items()]
    body += [_end_drawn(layers.boxes[end], end) for end in ends]
    body += [_label_drawn(layers.boxes[label], change, verb) for label, change in labels]
    start = layers.boxes[_START]
    body.append(f'<circle cx="{start.x + 6:.1f}" cy="{start.y + 6:.1f}" r="6" class="dot"/>')
    return sheet(*size, body, f"verb {verb.name}")


def _state(name: str) -> str:
    return f"list {name}"


def _title(verb: Verb[..., Any], name: str) -> str:
    return f"{name} (at every end)" if name == verb.ending else name


def _changes(verb: Verb[..., Any]) -> tuple[list[_Change], list[str]]:
    """Returns the transitions and the ends; conditions of one list with the same target are merged."""
    found: dict[tuple[str, str], list[str]] = {}
    ends: dict[str, None] = {}
    for name, condition, outcome in verb.table():
        if outcome.startswith("→ "):
            head = _state(outcome[2:])
        else:
            head = outcome.removeprefix("ends, ")
            ends[head] = None
        found.setdefault((_state(name), head), []).append(condition)
    last = [name for name, commands in verb.command_lists.items() if not any(tail == _state(name) for tail, _ in found)]
    for name in last:
        # The list has no conditions: it ends when it has run.
        found[_state(name), "ends"] = ["completed"]
        ends["ends"] = None
    return [_Change(tail, head, conditions) for (tail, head), conditions in found.items()], [*ends]


def _middle(boxes: list[Box], name: str) -> float:
    box = next(box for box in boxes if box.name == name)
    return _HEAD / 2 if name.startswith("list ") else box.height / 2


def _state_size(name: str, lines: list[str]) -> tuple[float, float]:
    return max(wide(name) + 24, *(wide(line, soft=True) + 22 for line in lines), 90.0), _HEAD + LINE * len(lines) + 8


def _edge_drawn(layers: Layers, edge: Edge, labels: list[tuple[str, _Change]]) -> str:
    change = next((c for label, c in labels if label in (edge.tail, edge.head)), None)
    arrow = edge.head not in dict(labels)
    about = attribute("change", f"{change.tail} {change.head}") if change and arrow else ""
    drawn = wire(way(layers, edge), "", "", about)
    return drawn if arrow else drawn[: drawn.index(" marker-end")] + "/></g>"


def _state_drawn(box: Box, title: str, name: str, lines: list[str]) -> str:
    parts = [rect(box.x, box.y, box.width, box.height, "box"), rect(box.x + 1, box.y + 1, box.width - 2, _HEAD - 3, "head", 4)]
    parts.append(text(box.x + 10, box.y + _HEAD / 2, title, "name"))
    parts += [text(box.x + 10, box.y + _HEAD + 4 + LINE * (n + 0.5), line, "soft") for n, line in enumerate(lines)]
    return f"<g{attribute('list', name)}>{''.join(parts)}</g>"


def _end_drawn(box: Box, end: str) -> str:
    look = "fail" if end.startswith("raises") else "end"
    words = text(box.x + box.width / 2, box.y + box.height / 2, clip(end, _LONGEST), "", "middle")
    return f"<g{attribute('end', end)}>{tooltip(end)}{rect(box.x, box.y, box.width, box.height, look, 14)}{words}</g>"


def _label_drawn(box: Box, change: _Change, verb: Verb[..., Any]) -> str:
    lines = [text(box.x + box.width / 2, box.y + LINE * (n + 0.5), c, "", "middle") for n, c in enumerate(change.conditions)]
    stands = [
        f"{key}: {', '.join(t.on) or 'of the system'}" for key, t in verb.conditions.items() if verb.reported(key) in change.conditions
    ]
    return f"<g{attribute('conditions', ' '.join(change.conditions))}>{tooltip('; '.join(stands))}{''.join(lines)}</g>"


def command_text(command: dict[str, Any]) -> str:
    """Formats a command as short text: `activate generator every 20 ms`."""
    kind = command["command"]
    if kind == "install":
        return f"install {', '.join(command['blocks'])}"
    if kind in ("execute", "deactivate"):
        return f"{kind} {command['block']}"
    if kind == "activate":
        every = f" every {duration_text(command['every_ns'])}" if command.get("every_ns") else ""
        return f"activate {command['block']}{every}{' (tunable)' if command.get('tunable') else ''}"
    if kind == "wait":
        until = " or ".join(command.get("conditions") or [])
        return f"wait {duration_text(command['time_ns'])}" if command.get("time_ns") else f"wait {until}".rstrip()
    return str(kind)
