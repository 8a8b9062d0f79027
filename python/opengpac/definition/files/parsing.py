# SPDX-License-Identifier: Apache-2.0
"""Parses the text of a definition file into a tree, and reports errors with their lines."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path as File
from typing import Any, NoReturn

from ...errors import DefinitionError, Error, FileFailed
from ...refusals.source_location import Place
from .form import Finding
from .positions import Path, line_at


def is_toml(file: File) -> bool:
    """Returns whether the file has a TOML extension."""
    if file.suffix not in (".toml", ".json"):
        raise FileFailed(f"file '{file}' is neither TOML nor JSON", remedy="rename it to end in .toml or .json", place=Place(str(file), 1))
    return file.suffix == ".toml"


DEPTH_MAX = 100
"""Maximum nesting depth of tables and lists in a file; each nested graph takes four levels."""
BLOCKS_MAX = 4000
"""Maximum total number of blocks in all definitions of a file; checking that many takes two seconds."""


def parsed(file: File, text: str, toml: bool) -> Any:
    """Parses a text into a tree; errors include line numbers. Refuses excessive nesting, and definitions with too many blocks."""
    try:
        tree = tomllib.loads(text) if toml else json.loads(text, object_pairs_hook=_once, parse_constant=_no_constant)
        _check_extent(file, tree)
        return tree
    except RecursionError:
        _refuse_deep(file)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r" \(at line (\d+), column \d+\)$", str(error))
        line, why = (int(found[1]), str(error)[: found.start()]) if found else (max(1, text.count("\n")), str(error))
    except json.JSONDecodeError as error:
        line, why = error.lineno, error.msg
    except ValueError as error:
        line, why = 1, str(error)
    what = "TOML" if toml else "JSON"
    raise DefinitionError(
        f"the file is not valid {what}: {why[:1].lower()}{why[1:]}", remedy="fix this line first", place=Place(str(file), line)
    ) from None


def _refuse_deep(file: File) -> NoReturn:
    message = f"the tables and lists of the file are nested more than {DEPTH_MAX} levels deep"
    remedy = "define nested graphs by name and use these names as blocks"
    raise DefinitionError(message, remedy=remedy, place=Place(str(file), 1)) from None


def _check_extent(file: File, tree: Any) -> None:
    left: list[tuple[Any, str, int]] = [(tree, "", 0)]
    blocks = 0
    while left:
        value, key, depth = left.pop()
        if depth > DEPTH_MAX:
            _refuse_deep(file)
        blocks += len(value) if key == "blocks" and isinstance(value, dict) else 0
        if isinstance(value, dict):
            left.extend((inner, name, depth + 1) for name, inner in value.items())
        elif isinstance(value, list):
            left.extend((inner, "", depth + 1) for inner in value)
    if blocks > BLOCKS_MAX:
        raise DefinitionError(
            f"the definitions of the file have {blocks} blocks in total, more than {BLOCKS_MAX}",
            remedy="split them across several files, or create them in a program",
            place=Place(str(file), 1),
        )
    _check_multiplied(file, tree)


def _check_multiplied(file: File, tree: Any) -> None:
    """Refuses a definition that expands to too many blocks because of nested graphs."""
    graphs = tree.get("graphs") if isinstance(tree, dict) else None
    counts: dict[str, int] = {}

    def count(definition: Any) -> int:
        blocks = definition.get("blocks") if isinstance(definition, dict) else None
        return sum(_blocks_of(use, of_graph) for use in blocks.values()) if isinstance(blocks, dict) else 0

    def of_graph(name: str) -> int:
        if name not in counts and isinstance(graphs, dict) and name in graphs:
            # Circles are reported where they are made.
            counts[name] = 0
            counts[name] = count(graphs[name])
        return counts.get(name, 1)

    for kind in ("graphs", "verbs") if isinstance(tree, dict) else ():
        known = tree.get(kind)
        for name, definition in known.items() if isinstance(known, dict) else ():
            found = of_graph(name) if kind == "graphs" else count(definition)
            if found > BLOCKS_MAX:
                raise DefinitionError(
                    f"'{name}' has {found if found < 10**6 else 'more than a million'} blocks, including those of its graphs, "
                    f"more than {BLOCKS_MAX}",
                    remedy="split it into several verbs",
                    place=Place(str(file), 1),
                )


def _blocks_of(use: Any, of_graph: Callable[[str], int]) -> int:
    """Returns the number of blocks in one use of a block or a graph."""
    block = use.get("block") if isinstance(use, dict) else use
    if isinstance(block, dict) and isinstance(block.get("graph"), dict):
        inner = block["graph"].get("blocks")
        return sum(_blocks_of(one, of_graph) for one in inner.values()) if isinstance(inner, dict) else 1
    return of_graph(block) if isinstance(block, str) and "." not in block else 1


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for key, value in pairs:
        if key in made:
            raise ValueError(f"'{key}' occurs twice in one object")
        made[key] = value
    return made


def _no_constant(text: str) -> Any:
    raise ValueError(f"{text} is not a number")


def error_of(finding: Finding, file: File, lines: dict[Path, int]) -> Error:
    """Converts a finding to an exception."""
    return finding.kind(finding.message, remedy=finding.remedy, place=Place(str(file), line_at(lines, finding.path)))
