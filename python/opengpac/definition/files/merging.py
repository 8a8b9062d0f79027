# SPDX-License-Identifier: Apache-2.0
"""Merges changes into hand-edited TOML text; unchanged parts keep their formatting, including comments and order."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, MutableMapping
from typing import Any

import tomlkit
from tomlkit.items import AoT

from .rendering import toml_definition, toml_entry, toml_value
from .shortening import long, short
from .trees import Tree


def merged(text: str, tree: Tree, head: Tree, trees: Mapping[str, Mapping[str, Tree]]) -> str:
    """Returns the text with these definitions, in the long form, and with the contents of `head`."""
    document = tomlkit.parse(text)
    more: list[str] = []
    for key, value in head.items():
        if tree.get(key) != value:
            document[key] = _item(value)
    for kind, known in trees.items():
        for key, new in known.items():
            if key not in tree.get(kind, {}):
                more.append(toml_definition(kind, key, short(kind, key, new)))
                continue
            old = long(kind, key, tree[kind][key])
            if old != long(kind, key, new):
                _merge(_table(document, kind)[key], short(kind, key, old), short(kind, key, new))
    made = tomlkit.dumps(document)
    made += "" if made.endswith("\n") else "\n"
    made = "\n".join([made, *more])
    return made if _holds(made, trees) else _anew(text, tree, head, trees)


def _table(document: tomlkit.TOMLDocument, kind: str) -> Any:
    return document[kind]


def _holds(text: str, trees: Mapping[str, Mapping[str, Tree]]) -> bool:
    """Returns whether the text contains exactly the given definitions."""
    try:
        found = tomllib.loads(text)
        return all(long(kind, key, found[kind][key]) == long(kind, key, new) for kind, known in trees.items() for key, new in known.items())
    except (tomllib.TOMLDecodeError, KeyError, RecursionError):
        return False


def _anew(text: str, tree: Tree, head: Tree, trees: Mapping[str, Mapping[str, Tree]]) -> str:
    """Replaces old definitions as a whole, and returns the text. Used for changes that cannot be made line by line."""
    document = tomlkit.parse(text)
    for key, value in head.items():
        document[key] = _item(value)
    for kind, known in trees.items():
        for key in known:
            if key in tree.get(kind, {}):
                _table(document, kind).remove(key)
    tables = [toml_definition(kind, key, short(kind, key, new)) for kind, known in trees.items() for key, new in known.items()]
    return "\n".join([tomlkit.dumps(document), *tables])


def _merge(node: MutableMapping[str, Any], old: Tree, new: Tree) -> None:
    """Applies the differences between the old and the new short form to the hand-written text of the old one."""
    for key in [key for key in old if key not in new]:
        node.pop(key, None)
    for key, value in new.items():
        before = old.get(key)
        if before == value and key in node:
            continue
        present = node.get(key)
        if _alike(present, before, value):
            _merge(present, before, value)  # type: ignore[arg-type]
        elif _same_length(present, before, value):
            for number, inner in enumerate(value):
                if before[number] != inner:  # type: ignore[index]
                    _put(present, number, before[number], inner)  # type: ignore[index]
        else:
            if isinstance(present, AoT):
                del node[key]
            node[key] = _item(value)


def _put(node: Any, at: int, old: Any, new: Any) -> None:
    if _alike(node[at], old, new):
        _merge(node[at], old, new)
    else:
        node[at] = _item(new)


def _alike(present: Any, old: Any, new: Any) -> bool:
    """Returns whether a table can be changed key by key, that is, whether it is structured like the short form."""
    return isinstance(present, MutableMapping) and isinstance(old, dict) and isinstance(new, dict) and {*old} <= {*present}


def _same_length(present: Any, old: Any, new: Any) -> bool:
    return all(isinstance(of, list) for of in (present, old, new)) and len(present) == len(old) == len(new)


def _item(value: Any) -> Any:
    """Converts a value to an item of the document, with one command per line."""
    if isinstance(value, dict) and any(isinstance(inner, dict | list) for inner in value.values()):
        table = tomlkit.table()
        for key, inner in value.items():
            table[key] = tomlkit.parse(f"x = {toml_entry(inner)}\n")["x"]
        return table
    return tomlkit.parse(f"x = {toml_entry(value) if not isinstance(value, dict) else toml_value(value)}\n")["x"]
