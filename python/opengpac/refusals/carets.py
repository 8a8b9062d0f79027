# SPDX-License-Identifier: Apache-2.0
"""Displays errors like a compiler: file, line, column, the line with a caret, both ends, and the remedy."""

from __future__ import annotations

import ast
import functools
import linecache
import os
import re
from collections.abc import Iterator

from ..errors import CallError, Error, UnknownName, ValueRefused
from .source_location import Place, packaged

_QUOTED = re.compile(r"'([^'\s]+)'")


def shown(error: Error, kind: str = "") -> str:
    """Returns the text of an error with its line, a caret, the other ends and the remedy.
    >>> print(shown(Error("there is no block 'pdi'", remedy="did you mean 'pid'?")))
    error: there is no block 'pdi'
      help: did you mean 'pid'?
    """
    name = kind or ("error" if type(error) is Error else type(error).__name__)
    lines = [f"{name}: {error.message or error}"]
    if error.place is not None:
        words = _words(error.message, last_first=isinstance(error, UnknownName | ValueRefused | CallError))
        line, column, length = _found(error.place, words, error.message)
        lines[0] = f"{_short(error.place.file)}:{line}:{column + 1}: {lines[0]}"
        lines += _line(line, error.place.file, column, length)
    for end in error.ends:
        if end.place is not None and end.place != error.place and not packaged(end.place):
            lines.append(f"  note: {end.what} is defined here")
            line, column, length = _found(end.place, _words(end.what), end.what)
            lines += _line(line, end.place.file, column, length)
    if error.remedy:
        lines.append(f"  help: {error.remedy}")
    return "\n".join(lines)


def _line(number: int, file: str, column: int, length: int) -> list[str]:
    text = linecache.getline(file, number).rstrip("\n")
    if not text:
        return []
    return [f"{number:>6} | {text}", f"       | {' ' * column}{'^' * max(1, length)}"]


def _short(file: str) -> str:
    relative = os.path.relpath(file) if os.path.isabs(file) else file
    return relative if len(relative) < len(file) else file


@functools.cache
def _found(place: Place, words: tuple[str, ...], message: str) -> tuple[int, int, int]:
    """Returns the line, column and length of the first of the words that occurs in the statement at that location; if none occurs, those
    of the statement's first line.

    In a definition file the line is exact: the error is on it.
    """
    file, line = place
    lines = linecache.getlines(file)
    first = lines[line - 1] if 0 < line <= len(lines) else ""
    begin = len(first) - len(first.lstrip())
    fallback = (line, begin, max(1, len(first.strip())))
    if not file.endswith(".py"):
        return next(((line, at, len(word)) for word in words if (at := first.find(word)) >= 0), fallback)
    try:
        tree = ast.parse("".join(lines))
    except SyntaxError:
        return fallback
    statement = _statement(tree, line)
    if statement is None:
        return fallback
    for word in words:
        for node in _named(statement, word, message):
            at = node.col_offset
            same_line = node.end_lineno == node.lineno and node.end_col_offset is not None
            length = (node.end_col_offset or at) - at if same_line else 1
            text = lines[node.lineno - 1]
            return node.lineno, len(text.encode()[:at].decode(errors="ignore")), max(1, length)
    return fallback


def _words(message: str, last_first: bool = False) -> tuple[str, ...]:
    """Returns the names that a message quotes, as written in the program: first combined, `planner.goal` for `'planner' … has no
    'goal'`, then each alone.

    A port is more specific than a block or list. The context of an unknown name precedes it, so in that case the last name is the one
    to mark.
    """
    quoted = _QUOTED.findall(message)
    joined = [f"{a}.{b}" for a in quoted for b in quoted if a != b]
    single = sorted(quoted[::-1] if last_first else quoted, key=lambda name: "." not in name)
    parts = [part for name in single if "." in name for part in (name.rsplit(".", 1)[0], name.rsplit(".", 1)[1])]
    return (*joined, *single, *parts)


def _statement(tree: ast.Module, line: int) -> ast.AST | None:
    """Returns the smallest statement that contains the line. Decorators belong to their definition."""
    best: tuple[int, ast.AST] | None = None
    for node in ast.walk(tree):
        if not isinstance(node, ast.stmt) or node.end_lineno is None:
            continue
        begin = min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])
        if begin <= line <= node.end_lineno and (best is None or node.end_lineno - begin <= best[0]):
            best = (node.end_lineno - begin, node)
    return best[1] if best else None


def _named(statement: ast.AST, word: str, message: str) -> Iterator[ast.expr | ast.keyword]:
    """Yields the positions of a word as a string, keyword or name: first in the arguments that the message names, then in program order."""
    spoken = {id(inner) for k in ast.walk(statement) if isinstance(k, ast.keyword) and _speaks_of(message, k.arg) for inner in ast.walk(k)}
    found = [
        node
        for node in ast.walk(statement)
        if (isinstance(node, ast.Constant) and node.value == word)
        or (isinstance(node, ast.keyword) and node.arg == word)
        or (isinstance(node, ast.Name) and node.id == word)
        or (isinstance(node, ast.Attribute) and node.attr == word)
    ]
    yield from sorted(found, key=lambda node: (id(node) not in spoken, node.lineno, node.col_offset))


def _speaks_of(message: str, keyword: str | None) -> bool:
    """Returns whether a message names an argument: `the condition 'done' …` refers to `conditions=`."""
    return keyword is not None and keyword.removesuffix("s").replace("_", " ") in message
