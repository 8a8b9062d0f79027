# SPDX-License-Identifier: Apache-2.0
"""Refusals of the real-time system reach a user as exceptions of this package: each call of the binding is inside `with refusals:`."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac

PACKAGE = Path(gpac.__file__).parent

CANNOT_REFUSE = {
    "version",
    "is_word_of_c",
    "header_text",
    "driver_header_text",
    "counting_text",
    "nearest",
    "did_you_mean",
    "library_json",
    "drivers_json",
    "run_plant",
    "Refused",
    "source_endings",
    *(f"pose_{name}" for name in ("of", "of_rpy", "rpy", "then", "point", "inverse", "between")),
}
"""Calls of the binding that return stored values or compute with numbers, and take no argument that could be refused."""


def is_binding(value: ast.expr, aliases: set[str]) -> bool:
    """Returns whether an expression is the binding, or a system of it."""
    match value:
        case ast.Name(id=name):
            return name == "_native" or name in aliases
        case ast.Attribute(attr="_native"):
            return True
        case ast.Call(func=ast.Attribute(attr="_alive")):
            return True
    return False


def converted(node: ast.AST) -> bool:
    """Returns whether a statement converts refusals into exceptions."""
    match node:
        case ast.With(items=items):
            return any("refusals" in ast.unparse(item.context_expr) or "Refused" in ast.unparse(item.context_expr) for item in items)
        case ast.Try(handlers=handlers):
            return any(handler.type is not None and "Refused" in ast.unparse(handler.type) for handler in handlers)
    return False


def bare(node: ast.AST, aliases: set[str], inside: bool) -> Iterator[ast.Call]:
    """Yields the calls of the binding below `node` whose refusals are not converted."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.Lambda():
            inside = inside and isinstance(node, ast.Lambda)
            assigned = [one for one in ast.walk(node) if isinstance(one, ast.Assign) and is_binding(one.value, aliases)]
            aliases = aliases | {target.id for one in assigned for target in one.targets if isinstance(target, ast.Name)}
        case ast.Call(func=ast.Attribute(value=value, attr=name)) if is_binding(value, aliases) and name not in CANNOT_REFUSE:
            if not inside:
                yield node
    for child in ast.iter_child_nodes(node):
        yield from bare(child, aliases, inside or converted(node))


def calls(text: str) -> list[str]:
    """Returns the unconverted calls of a program, as text."""
    return [ast.unparse(call) for call in bare(ast.parse(text), set(), False)]


def test_every_call_of_the_binding_turns_refusals_into_exceptions() -> None:
    found = {str(file.relative_to(PACKAGE)): calls(file.read_text()) for file in sorted(PACKAGE.rglob("*.py"))}
    assert not {file: those for file, those in found.items() if those}


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("def f(s):\n    s._native.now()", 1),
        ("def f(s):\n    with refusals:\n        s._native.now()", 0),
        ("def f(s):\n    n = s._alive()\n    n.now()", 1),
        ("def f(s):\n    with refusals:\n        def g():\n            s._native.now()", 1),
        ("def f(s):\n    with refusals:\n        return map(lambda x: s._native.write(x), y)", 0),
        ("def f(s):\n    try:\n        s._native.now()\n    except _native.Refused:\n        pass", 0),
        ("_native.version()", 0),
    ],
)
def test_the_search_finds_them(text: str, count: int) -> None:
    assert len(calls(text)) == count
