# SPDX-License-Identifier: Apache-2.0
"""Checks a block's body: refuses unsupported code, with its line and an alternative, before it reaches numba."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Collection, Mapping
from types import ModuleType
from typing import Any

import numpy as np

from .items import Item, Refusing

CALLS = {"abs", "min", "max", "range", "len", "int", "float", "bool", "round"}
_MATH = (
    "acos acosh asin asinh atan atan2 atanh ceil copysign cos cosh degrees e erf erfc exp exp2 expm1 fabs floor gcd hypot inf isfinite "
    "isinf isnan lgamma log log10 log1p log2 nan pi pow radians sin sinh sqrt tan tanh tau trunc"
)
MATH = frozenset(_MATH.split())
"""Supported functions and constants of `math`."""

_LOOP = "write a loop over the elements, for i in range(6)"
_OWN_ITEM = 'use numbers and arrays: declare an array as an item, State(type="double[6]")'

STATEMENTS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Raise: ("it raises an exception", "set a condition, c: Annotated[bool, Condition(\"…\")], to True"),
    ast.Assert: ("it asserts", "set a condition to True if that does not hold"),
    ast.Try: ("it catches exceptions", "test for the case beforehand, with if"),
    ast.With: ("it has a 'with' statement", "use a driver for resources; a block has only its arguments"),
    ast.Lambda: ("it defines a function", "write its expression where it is used"),
    ast.FunctionDef: ("it defines a function", "write its body where it is used"),
    ast.AsyncFunctionDef: ("it defines a function", "write its body where it is used"),
    ast.ClassDef: ("it defines a class", _OWN_ITEM),
    ast.Import: ("it imports", "import math at the top of the file"),
    ast.ImportFrom: ("it imports", "import math at the top of the file"),
    ast.Global: ("it changes a variable of its module", "declare a State"),
    ast.Nonlocal: ("it changes a variable of a function", "declare a State"),
    ast.Delete: ("it deletes a name", "leave it out"),
    ast.List: ("it makes a list, which is an allocation", _OWN_ITEM),
    ast.Dict: ("it makes a dictionary, which is an allocation", _OWN_ITEM),
    ast.Set: ("it makes a set, which is an allocation", _OWN_ITEM),
    ast.ListComp: ("it makes a list, which is an allocation", _LOOP),
    ast.SetComp: ("it makes a set, which is an allocation", _LOOP),
    ast.DictComp: ("it makes a dictionary, which is an allocation", _LOOP),
    ast.GeneratorExp: ("it makes a generator, which is an allocation", _LOOP),
    ast.Yield: ("it is a generator", "store its state in a State"),
    ast.YieldFrom: ("it is a generator", "store its state in a State"),
    ast.Await: ("it waits", "make the input asynchronous"),
    ast.JoinedStr: ("it makes a string", "set a condition, or print an SVV in the program"),
    ast.Starred: ("it unpacks a sequence", _LOOP),
    ast.Match: ("it has a 'match' statement", "write if and elif"),
    ast.NamedExpr: ("it assigns inside an expression", "write the assignment on a separate line"),
    ast.MatMult: ("it multiplies matrices, which is an allocation", _LOOP),
}  # fmt: skip


RETURNS_A_VALUE = ("it returns a value", "assign it to an output; write return alone, or with names of outputs and states: return y")


def tells_written(node: ast.Return, written: Collection[str]) -> bool:
    """Returns whether a `return` has no value, or only the names of `written` arguments: `return y, x` shows a linter that they are
    used."""
    names = node.value.elts if isinstance(node.value, ast.Tuple) else [] if node.value is None else [node.value]
    return all(isinstance(name, ast.Name) and name.id in written for name in names)


def check_body(tree: ast.FunctionDef, items: list[Item], invocation: str | None, names: Mapping[str, Any], refusing: Refusing) -> None:
    """Refuses the first construct of a body that cannot be compiled. `names` contains the values of its global names."""
    by_name = {item.name: item for item in items}
    local = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    found: list[tuple[int, int, Callable[[], object]]] = []
    docstring = ast.get_docstring(tree) is not None
    called = {id(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)}
    bases = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    for part in tree.body[1 if docstring else 0 :]:
        for node in ast.walk(part):
            problem = _problem(node, by_name, local, invocation, names, called, bases, tree.name)
            if problem:
                line = getattr(node, "lineno", part.lineno)
                found.append((line, getattr(node, "col_offset", 0), lambda line=line, problem=problem: refusing(line, *problem)))
    if found:
        min(found, key=lambda one: one[:2])[2]()


def _problem(
    node: ast.AST,
    items: Mapping[str, Item],
    local: set[str],
    invocation: str | None,
    names: Mapping[str, Any],
    called: set[int],
    bases: set[int],
    own: str,
) -> tuple[str, str] | None:
    if type(node) in STATEMENTS:
        return STATEMENTS[type(node)]
    if isinstance(node, ast.Return) and not tells_written(node, [item.name for item in items.values() if item.written]):
        return RETURNS_A_VALUE
    if isinstance(node, ast.Constant) and (node.value is None or isinstance(node.value, str | bytes | complex)):
        what = "None" if node.value is None else "a complex number" if isinstance(node.value, complex) else "text"
        return f"it uses {what}", "use numbers: fixed-width integers, float, double, bool, or arrays of them"
    if isinstance(node, ast.Call):
        return _call_problem(node, names, own)
    if isinstance(node, ast.Attribute):
        return _attribute_problem(node, invocation, names)
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        return _store_problem(node.id, items, invocation)
    if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
        base = node.value.id if isinstance(node.value, ast.Name) else ""
        if base in items and not items[base].written:
            return f"it changes '{base}', which the block may only read", "write to an output or a State"
    if isinstance(node, ast.Name) and id(node) not in called | bases and node.id not in items and node.id not in local | {invocation}:
        return _outside_problem(node.id, names)
    return None


def _call_problem(node: ast.Call, names: Mapping[str, Any], own: str) -> tuple[str, str] | None:
    if node.keywords:
        return "it passes an argument by keyword", "pass the arguments by position"
    if isinstance(node.func, ast.Name):
        name = node.func.id
        if name == own:
            return "it calls itself", "write a loop"
        if name == "print":
            return "it prints", "use an output or a condition instead"
        if name in ("list", "dict", "set", "str", "tuple", "sorted", "bytearray", "bytes", "map", "filter", "zip"):
            return f"it calls {name}(), which creates a Python object", _OWN_ITEM
        if name == "round" and name not in names and len(node.args) > 1:
            return "it rounds to a number of digits, which compiled code does differently from Python", "write round(x * 100) / 100"
        if name in CALLS and name not in names:
            return None
        if getattr(names.get(name), "__module__", None) == "math":
            return _math_problem(names[name].__name__)
        return f"it calls '{name}', which is not compiled", f"write its body where it is used; {_allowed()}"
    if isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name) and names.get(node.func.value.id) in (math, np):
        return None
    return f"it calls '{ast.unparse(node.func)}'", _allowed()


def _allowed() -> str:
    return f"call only {', '.join(sorted(CALLS))} and functions of math"


def _math_problem(name: str) -> tuple[str, str] | None:
    """Returns the problem with a name of `math`, or None if it is supported."""
    return None if name in MATH else (f"it uses math.{name}, which is not compiled", f"use one of {', '.join(sorted(MATH))}")


def _attribute_problem(node: ast.Attribute, invocation: str | None, names: Mapping[str, Any]) -> tuple[str, str] | None:
    base = node.value.id if isinstance(node.value, ast.Name) else None
    if base is not None and base == invocation:
        known = ("number", "time", "time_ns", "now_ns")
        return None if node.attr in known else (f"an invocation has no '{node.attr}'", f"use {', '.join(known)}")
    module = names.get(base) if base else None
    if module is math and hasattr(math, node.attr):
        return _math_problem(node.attr)
    if module is np and (isinstance(getattr(np, node.attr, None), np.ufunc | float | type)):
        return None
    if isinstance(module, ModuleType):
        return f"it uses {module.__name__}.{node.attr}", _allowed()
    return f"it uses '{ast.unparse(node)}', an attribute of a Python object", "declare the value as a Parameter or a State"


def _store_problem(name: str, items: Mapping[str, Item], invocation: str | None) -> tuple[str, str] | None:
    if name == invocation:
        return f"it changes '{name}'", "use another name"
    item = items.get(name)
    if item is not None and not item.written:
        return f"it changes '{name}', which the block may only read", "use a variable of another name, or a State"
    if item is not None and item.shape:
        return f"it replaces array '{name}'", f"change its elements, {name}[i] = …"
    return None


def _outside_problem(name: str, names: Mapping[str, Any]) -> tuple[str, str] | None:
    if name not in names:
        return (f"'{name}' is undefined", "declare it as an item, or assign to it first") if name not in CALLS else None
    if isinstance(names[name], bool | int | float):
        return None
    what = type(names[name]).__name__
    return (
        f"it uses '{name}' of its module, which is a {what}",
        "declare it as a Parameter or a State: a block may use only numbers of its module",
    )
