# SPDX-License-Identifier: Apache-2.0
"""The stub of a program: its imports, functions and classes as declared, and its verbs with their calls."""

from __future__ import annotations

import ast
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...definition.blocks import Block
from ...definition.graphs import Graph
from ...definition.verbs import Verb
from .calls import verb_class
from .ports import block_class

_HEAD = """\
# Made by opengpac stubs from {name}: regenerate it when a verb changes.
from collections.abc import Mapping as _Mapping, Sequence as _Sequence
from typing import Any as _Any, Never as _Never

import numpy as _np

import opengpac as _gpac
from opengpac.definition.block_trial import Trial as _Trial

"""


def stub(program: Path, names: Mapping[str, Any]) -> str:
    """Returns the text of the stub, from the program's source and the names bound by its execution."""
    tree = ast.parse(program.read_text(encoding="utf-8"), str(program))
    made: dict[str, list[str]] = {}
    imports: list[str] = []
    for statement in tree.body:
        _statement(statement, names, made, imports)
    rest = [name for name in names if name not in made and not name.startswith("_") and not isinstance(names[name], types.ModuleType)]
    imported = {
        alias.asname or alias.name.split(".")[0] for s in ast.walk(tree) if isinstance(s, ast.Import | ast.ImportFrom) for alias in s.names
    }
    for name in rest:
        if name not in imported:
            made[name] = _bound(name, names[name])
    lines = [*imports, *([""] if imports else []), *(line for known in made.values() for line in known)]
    return _HEAD.format(name=program.name) + "\n".join(lines).rstrip() + "\n"


def _statement(statement: ast.stmt, names: Mapping[str, Any], made: dict[str, list[str]], imports: list[str]) -> None:
    match statement:
        case ast.Import() | ast.ImportFrom():
            if not (isinstance(statement, ast.ImportFrom) and statement.module == "__future__"):
                imports.append(ast.unparse(statement))
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            made[statement.name] = _function(statement, names.get(statement.name))
        case ast.ClassDef():
            made[statement.name] = _class(statement, "")
        case ast.AnnAssign(target=ast.Name(id=name)) if not isinstance(names.get(name), Verb):
            made[name] = [f"{name}: {ast.unparse(statement.annotation)}"]
        case ast.If() if "TYPE_CHECKING" in ast.unparse(statement.test):
            for inner in statement.body:
                _statement(inner, names, made, imports)
        case _:
            pass


def _function(function: ast.FunctionDef | ast.AsyncFunctionDef, value: Any) -> list[str]:
    """Returns the signature of a function. For a verb, keeps the verb's own class, with the function's parameters."""
    head = ast.unparse(_bare(function))
    if isinstance(value, Verb):
        return ["@_gpac.verb(blocks={}, command_lists={})", *head.splitlines(), ""]
    if isinstance(value, Block):
        return _bound(function.name, value)
    decorators = [f"@{ast.unparse(decorator)}" for decorator in function.decorator_list]
    return [*decorators, *head.splitlines(), ""]


def _bare(function: ast.FunctionDef | ast.AsyncFunctionDef) -> ast.AST:
    """Returns the function without body and decorators; defaults are `...`."""
    given = function.args
    plain = ast.arguments(
        posonlyargs=given.posonlyargs, args=given.args, vararg=given.vararg, kwonlyargs=given.kwonlyargs, kwarg=given.kwarg,
        defaults=[ast.Constant(...) for _ in given.defaults],
        kw_defaults=[None if default is None else ast.Constant(...) for default in given.kw_defaults],
    )  # fmt: skip
    made = type(function)(function.name, plain, [ast.Expr(ast.Constant(...))], [], function.returns)
    return ast.fix_missing_locations(ast.copy_location(made, function))


def _class(found: ast.ClassDef, indent: str) -> list[str]:
    bases = ", ".join([*map(ast.unparse, found.bases), *(f"{k.arg}=..." for k in found.keywords if k.arg)])
    lines = [f"{indent}@{ast.unparse(decorator)}" for decorator in found.decorator_list]
    lines.append(f"{indent}class {found.name}{f'({bases})' if bases else ''}:")
    inner = f"{indent}    "
    body: list[str] = []
    for statement in found.body:
        match statement:
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                body += [f"{inner}{line}" for line in _function(statement, None)[:-1]]
            case ast.ClassDef():
                body += _class(statement, inner)[:-1]
            case ast.AnnAssign(target=ast.Name(id=name)):
                body.append(f"{inner}{name}: {ast.unparse(statement.annotation)}")
            case ast.Assign():
                body += [f"{inner}{target.id}: _Any" for target in statement.targets if isinstance(target, ast.Name)]
            case _:
                continue
    return [*lines, *(body or [f"{inner}..."]), ""]


def _bound(name: str, value: Any) -> list[str]:
    """Returns the declaration of a bound name, inferred from its current value."""
    if isinstance(value, Verb):
        return [*verb_class(f"_{name}", value), f"{name}: _{name}_Verb"]
    if isinstance(value, Block):
        return [*block_class(f"_{name}", value), f"{name}: _{name}_Block", ""]
    if isinstance(value, Graph):
        return [f"{name}: _gpac.Graph"]
    kind = type(value)
    if isinstance(value, type):
        return [f"{name}: type[_Any]"]
    if kind.__module__ == "builtins" and kind in (int, float, str, bool, bytes):
        return [f"{name}: {kind.__name__}"]
    import opengpac

    if getattr(opengpac, kind.__name__, None) is kind:
        return [f"{name}: _gpac.{kind.__name__}{'[_Any]' if kind.__name__ in ('SVV', 'Group', 'VerbInstance') else ''}"]
    return [f"{name}: _Any"]
