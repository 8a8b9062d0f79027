# SPDX-License-Identifier: Apache-2.0
"""Trees as text: TOML and JSON with one element per line, in a stable order, so that a diff shows the changes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

from .trees import Tree

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_SECTIONS = (
    "blocks", "inputs", "outputs", "objects", "instantiation_parameters", "cells", "input_parameters", "output_values", "command_lists",
    "conditions", "modes", "divide", "requires", "parts", "rename", "preset", "svvs", "parameters", "layout",
)  # fmt: skip
_WIDTH = 100


def toml_key(key: str) -> str:
    """Formats a key, quoted if necessary."""
    return key if _BARE.fullmatch(key) else toml_value(key)


def toml_value(value: Any) -> str:
    """Formats a value on one line."""
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return repr(value) if math.isfinite(value) else str(value)
        case str():
            # TOML escapes the same characters as JSON, and one more control character.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
        case Mapping():
            pairs = ", ".join(f"{toml_key(key)} = {toml_value(inner)}" for key, inner in value.items())
            return f"{{ {pairs} }}" if pairs else "{}"
        case list() | tuple():
            return f"[{', '.join(toml_value(inner) for inner in value)}]"
        case _:
            return str(value)


def toml_entry(value: Any) -> str:
    """Formats a value for a table: commands and transitions one per line, and multi-line text with its line breaks."""
    if isinstance(value, str) and "\n" in value:
        lines = "\n".join(json.dumps(line, ensure_ascii=False)[1:-1].replace("\x7f", "\\u007F") for line in value.split("\n"))
        plain = '"""' not in value and not value.endswith('"')
        return '"""\n' + (lines.replace('\\"', '"') if plain else lines) + '"""'
    if isinstance(value, list) and value and all(isinstance(inner, dict) for inner in value):
        return "[\n" + "".join(f"  {toml_value(inner)},\n" for inner in value) + "]"
    return toml_value(value)


def toml_definition(kind: str, key: str, tree: Tree) -> str:
    """Formats a definition as a table with its sections."""
    name = f"{kind}.{toml_key(key)}"
    sections = {section: tree[section] for section in _SECTIONS if isinstance(tree.get(section), dict)}
    lines = [f"[{name}]", *(f"{toml_key(k)} = {toml_entry(v)}" for k, v in tree.items() if k not in sections)]
    for section, inner in sections.items():
        lines += ["", f"[{name}.{section}]", *(f"{toml_key(k)} = {toml_entry(v)}" for k, v in inner.items())]
    return "\n".join(lines) + "\n"


def toml_file(head: Tree, trees: Mapping[str, Mapping[str, Tree]]) -> str:
    """Returns the text of a whole TOML file."""
    plain = {key: value for key, value in head.items() if not isinstance(value, dict)}
    parts = ["".join(f"{key} = {toml_value(value)}\n" for key, value in plain.items())]
    parts += [
        f"[{key}]\n" + "".join(f"{toml_key(k)} = {toml_value(v)}\n" for k, v in value.items())
        for key, value in head.items()
        if isinstance(value, dict) and value
    ]
    parts += [toml_definition(kind, key, tree) for kind, known in trees.items() for key, tree in known.items()]
    return "\n".join(parts)


def json_file(tree: Tree) -> str:
    """Returns the text of a whole JSON file."""
    return _json(tree, "") + "\n"


def _json(value: Any, indent: str) -> str:
    inner = indent + "  "
    text = json.dumps(value, ensure_ascii=False)
    nested = [
        v for v in (value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()) if isinstance(v, dict | list)
    ]
    if (
        not isinstance(value, dict | list)
        or not value
        or (len(text) <= _WIDTH and not any(isinstance(v, dict) or _deep(v) for v in nested))
    ):
        return text
    if isinstance(value, dict):
        lines = [f"{inner}{json.dumps(key, ensure_ascii=False)}: {_json(v, inner)}" for key, v in value.items()]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    return "[\n" + ",\n".join(inner + _json(v, inner) for v in value) + f"\n{indent}]"


def _deep(value: Any) -> bool:
    return any(isinstance(inner, dict | list) for inner in (value.values() if isinstance(value, dict) else value))
