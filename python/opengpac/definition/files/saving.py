# SPDX-License-Identifier: Apache-2.0
"""Writes definitions to a file. Other contents of the file are preserved, including comments and order."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path as File
from typing import Any, cast

from ...errors import FileFailed
from ...refusals.argument_types import taking
from ...refusals.source_location import Place
from ...storage import files
from ..blocks import modules_of
from .form import FORMAT, VERSION, findings
from .merging import merged
from .parsing import error_of, is_toml, parsed
from .positions import lines_of
from .rendering import json_file, toml_file
from .shortening import long, short
from .trees import KINDS, Definition, DefinitionTrees, Tree, kind_of


@taking
def save(path: str | os.PathLike[str], *definitions: Definition, description: str | None = None) -> None:
    """Writes graphs, verbs and device types to the TOML or JSON file at `path`; its extension selects the format. Preserves the other
    contents of an existing file.

    `definitions` replace those of the same name in the file; if only values change, comments and order of a TOML file are preserved.
    The verbs of a composed verb and of a device type are written too. Exception classes are written by name. `description` is a
    human-readable text at the top of the file. Raises `FileFailed` if the file has a different format or cannot be written.
    """
    file = File(path).expanduser()
    toml = is_toml(file)
    text = files.read(file, "the file of definitions")
    tree = _known(file, text, toml) if text and text.strip() else {}
    collected = DefinitionTrees({key: kind for kind in KINDS for key in tree.get(kind, {})})
    for definition in definitions:
        collected.add(definition)
    if toml:
        collected.share_graphs()
    head: Tree = {"description": description} if description is not None else {}
    modules = _modules(definitions, file)
    if not text or not tree:
        start = {"format": FORMAT, "version": VERSION, **head, **({"modules": modules} if modules else {})}
        files.write(file, _rendered(start, collected.trees, toml), "the file of definitions")
        return
    head |= {"modules": tree.get("modules", {}) | modules} if modules else {}
    if toml:
        files.write(file, merged(text, tree, head, collected.trees), "the file of definitions")
        return
    new = tree | head
    for kind in KINDS:
        kept = tree.get(kind, {})
        of = {key: _ordered(kept.get(key, {}), made) for key, made in collected.trees[kind].items()}
        if kept or of:
            new[kind] = kept | of
    files.write(file, json_file(new), "the file of definitions")


def _rendered(head: Tree, trees: Mapping[str, Mapping[str, Tree]], toml: bool) -> str:
    if toml:
        return toml_file(head, {kind: {key: short(kind, key, tree) for key, tree in known.items()} for kind, known in trees.items()})
    return json_file(head | {kind: dict(known) for kind, known in trees.items() if known})


def _known(file: File, text: str, toml: bool) -> Tree:
    """Returns the tree of the existing file. Refuses to overwrite a file that is not a definition file."""
    tree = parsed(file, text, toml)
    wrong = findings(tree)
    if wrong:
        why = error_of(wrong[0], file, lines_of(text, toml))
        raise FileFailed(
            f"cannot save to '{file}': {why.message}",
            remedy="fix it first, or save to another file",
            place=why.place or Place(str(file), 1),
        )
    return tree


def _ordered(old: Any, new: Any) -> Any:
    """Returns the new tree in the order of the old one."""
    if not isinstance(old, dict) or not isinstance(new, dict):
        return new
    keys = [key for key in old if key in new] + [key for key in new if key not in old]
    return {key: _ordered(old.get(key), new[key]) for key in keys}


def _modules(definitions: tuple[Definition, ...], file: File) -> dict[str, str]:
    """Returns the code modules of the blocks: name → file, relative to this file if possible."""
    found: dict[str, str] = {}
    for definition in definitions:
        uses = cast(Any, definition).blocks.values() if kind_of(definition) not in (None, "device_types") else ()
        for use in _all(uses):
            block = use.block
            if block.system is not None or block.module != "library":
                found[block.name.split(".", 1)[0]] = block.module
    home = file.absolute().parent
    return {name: os.path.relpath(path, home) if os.path.isabs(path) else path for name, path in found.items()}


def _all(uses: Any) -> list[Any]:
    """Returns the uses of application subroutines, including those within graphs."""
    found: list[Any] = []
    for use in uses:
        found += _all(use.block.blocks.values()) if kind_of(use.block) == "graphs" else [use]
    return found


__all__ = ["long", "modules_of", "save"]
