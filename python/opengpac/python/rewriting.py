# SPDX-License-Identifier: Apache-2.0
"""Rewrites a block's function for numba: written arguments become one-element arrays that are read at the start and stored at each exit."""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Mapping
from typing import Any

from .items import Item

INVOCATION = ("number", "time_ns", "now_ns")
"""Arguments that replace the invocation, each with a prefix: `opengpac_number`."""


def cell(name: str) -> str:
    """Returns the name of the array from which the scalar `name` is read and in which it is stored."""
    return f"opengpac_cell_{name}"


def rewritten(tree: ast.FunctionDef, items: list[Item], invocation: str | None, names: Mapping[str, Any], file: str) -> Callable[..., None]:
    """Returns the function in the form to be compiled. Line numbers remain those of the user's file."""
    made = copy.deepcopy(tree)
    made.decorator_list, made.returns = [], None
    arguments = [cell(i.name) if i.written and not i.shape else i.name for i in items] + [f"opengpac_{name}" for name in INVOCATION]
    made.args = ast.arguments(posonlyargs=[], args=[ast.arg(a) for a in arguments], kwonlyargs=[], kw_defaults=[], defaults=[])
    scalars = [i.name for i in items if i.written and not i.shape]
    first = ast.parse("\n".join(f"{name} = {cell(name)}[0]" for name in scalars)).body
    ends = ast.parse("\n".join([*(f"{cell(name)}[0] = {name}" for name in scalars), "return"])).body
    body = _Ends(ends, invocation).through(made.body)
    made.body = [_at(s, tree.lineno) for s in first] + body + [_at(s, tree.body[-1].end_lineno or tree.lineno) for s in ends]
    module = ast.fix_missing_locations(ast.Module([made], []))
    space = dict(names)
    exec(compile(module, file, "exec", dont_inherit=True), space)
    return space[tree.name]


def _at(statement: ast.stmt, line: int) -> ast.stmt:
    copied = copy.deepcopy(statement)
    for node in ast.walk(copied):
        if hasattr(node, "lineno"):
            node.lineno = node.end_lineno = line  # type: ignore[attr-defined]
    return copied


class _Ends(ast.NodeTransformer):
    """Inserts the stores before each `return`, and replaces the attributes of an invocation."""

    def __init__(self, ends: list[ast.stmt], invocation: str | None) -> None:
        self._ends = ends
        self._invocation = invocation

    def through(self, body: list[ast.stmt]) -> list[ast.stmt]:
        new: list[ast.stmt] = []
        for statement in body:
            result = self.visit(statement)
            new.extend(result if isinstance(result, list) else [result])
        return new

    def visit_Return(self, node: ast.Return) -> list[ast.stmt]:
        return [_at(s, node.lineno) for s in self._ends]

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        if not isinstance(node.value, ast.Name) or node.value.id != self._invocation:
            return self.generic_visit(node)
        text = "opengpac_time_ns * 1e-9" if node.attr == "time" else f"opengpac_{node.attr}"
        made = ast.parse(text, mode="eval").body
        for part in ast.walk(made):
            ast.copy_location(part, node)
        return made
