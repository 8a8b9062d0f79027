# SPDX-License-Identifier: Apache-2.0
"""The printed manual of a component."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence

from ..definition.blocks import Block, Item
from ..definition.parameters import InputParameter
from ..values.arrays import np
from .components import Component, items_of
from .examples import default_of, example

_WIDTH = 110
_DEFAULT_MAX = 32
"""Maximum length of a displayed default; longer ones are mostly structs."""


class Manual(str):
    """A text whose `repr` is the text itself."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def manual(component: Component) -> Manual:
    """Returns the manual of a component."""
    of = {"block": _block, "graph": _graph, "verb": _verb, "device type": _device_type}[component.kind]
    called = "the standard library" if component.origin == "library" else component.where
    head = f"{component.name}: {component.kind} of {called}, {component.category}"
    return Manual("\n".join([head, "", *of(component)]).rstrip())


def _block(component: Component) -> list[str]:
    block: Block = component.value
    equation, more, faults = _parts(block.doc)
    lines = [*_wrapped(equation, "  "), *([""] if more else []), *_wrapped(more, "  ")]
    for title, kinds in (
        ("inputs", ("input",)),
        ("outputs", ("output",)),
        ("devices", ("device_read", "device_write")),
        ("parameters", ("size", "parameter")),
        ("conditions", ("condition",)),
    ):
        rows = [_row(block, item) for item in items_of(block).values() if item.kind in kinds]
        lines += _table(title, rows)
    if faults:
        lines += ["", "faults: the invocation stores nothing, and the verb receives condition 'fault'", *(f"  {f}" for f in faults)]
    return [*lines, "", "to try it", *(f"  {line}" for line in example(component)), *_use(component)]


def _parts(doc: str) -> tuple[str, str, list[str]]:
    """Splits a block's description into the equation, the other text and the faults."""
    first, *others = doc.splitlines() or [""]
    faults = next((line.removeprefix("Faults: ").rstrip(".") for line in others if line.startswith("Faults: ")), "")
    more = " ".join(line for line in others if not line.startswith("Faults: "))
    return first, more, [part.strip() for part in re.split(r"; (?=\d+ )", faults) if part]


def _row(block: Block, item: Item) -> Sequence[str]:
    mode = item.mode if item.kind in ("input", "output") else ""
    kind = {"device_read": "read", "device_write": "write", "size": "size"}.get(item.kind, mode)
    return item.name, item.type or "-", item.unit or "-", kind or "-", _default(block, item), item.doc


def _default(block: Block, item: Item) -> str:
    if item.kind == "size":
        return f"{item.least} to {item.most}"
    shown = item.kind == "parameter" or (item.kind == "input" and item.has_default) or (item.kind == "condition" and bool(item.type))
    if not shown:
        return "-"
    value = default_of(block, item)
    if np.ndim(value):
        text = re.sub(r"\s+", " ", np.array2string(np.asarray(value), separator=", ", threshold=8))
    else:
        text = f"{value:.12g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _DEFAULT_MAX else f"{text[: _DEFAULT_MAX - 2]} …"


def _use(component: Component) -> list[str]:
    block: Block = component.value
    if not block.inputs or not block.outputs:
        return []
    first_in, first_out = next(iter(block.inputs)), next(iter(block.outputs))
    name = component.short_name
    return ["in a graph or verb", f'  blocks={{"{name}": lib.{name}}}, then "{name}.{first_in}", "{name}.{first_out}" are its ports']


def _graph(component: Component) -> list[str]:
    graph = component.value
    rows = [(name, "input", ", ".join(ports)) for name, ports in graph.inputs.items()]
    rows += [(name, "output", ", ".join(ports)) for name, ports in graph.outputs.items()]
    blocks = [(label, use.block.name, "") for label, use in graph.blocks.items()]
    return [*_wrapped(graph.doc, "  "), *_table("ports", rows), *_table("blocks", blocks)]


def _verb(component: Component) -> list[str]:
    verb = component.value
    inputs = [(name, *_said(given), ", ".join(given.targets)) for name, given in verb.input_parameters.items()]
    objects = [(name, given.device_type.definition_name(), "several" if given.each else "one") for name, given in verb.objects.items()]
    lines = [f"  {verb.name}{verb.signature}", "", *_wrapped(verb.doc, "  ")]
    lines += _table("objects", objects)
    lines += _table("instantiation parameters", [(name, ", ".join(ports)) for name, ports in verb.instantiation_parameters.items()])
    lines += _table("input parameters", inputs)
    lines += _table("output values", [(name, ", ".join(source)) for name, source in verb.output_values.items()])
    lines += _table("command list, condition, what happens", verb.table())
    return [*lines, *_table("blocks", [(label, use.block.name) for label, use in verb.blocks.items()])]


def _said(parameter: InputParameter) -> tuple[str, str, str]:
    """Formats the unit, the tunability and the default of an input parameter."""
    default = str(parameter.default) if parameter.has_default else "-"
    return parameter.unit or "-", "tunable" if parameter.tunable else "-", default


def _device_type(component: Component) -> list[str]:
    kind = component.value
    verb = kind.definition_verb()
    described = kind.definition_json()
    svvs = [(name, m["type_text"], m["unit"] or "-") for name, m in described["svvs"].items()]
    parameters = [
        (name, m["unit"] or "-", "tunable" if m["tunable"] else "-", str(m["default"])) for name, m in described["parameters"].items()
    ]
    kept = f"  kept up to date by verb {verb.name}{verb.signature}" if verb else "  not kept up to date by any verb"
    return [*_wrapped(component.doc, "  "), "", kept, *_table("SVVs", svvs), *_table("parameters", parameters)]


def _wrapped(text: str, indent: str) -> list[str]:
    parts = (textwrap.wrap(part.strip(), _WIDTH, initial_indent=indent, subsequent_indent=indent) for part in text.splitlines())
    return [line for part in parts for line in part]


def _table(title: str, rows: Iterable[Sequence[str]]) -> list[str]:
    """Formats rows in columns under a title. Omits columns that are empty in every row, and wraps the last column."""
    rows = list(rows)
    if not rows:
        return []
    columns = [i for i in range(len(rows[0])) if i == 0 or any(row[i] not in ("-", "") for row in rows)]
    widths = [min(max(len(row[i]) for row in rows), 40) for i in columns[:-1]]
    lines = ["", title]
    for row in rows:
        cells = "  ".join(row[i].ljust(width) for i, width in zip(columns, widths, strict=False))
        start = f"  {cells}  " if widths else "  "
        width = max(_WIDTH, len(start) + 30)
        wrapped = textwrap.wrap(row[columns[-1]], width, initial_indent=start, subsequent_indent=" " * len(start))
        lines += wrapped or [start.rstrip()]
    return lines
