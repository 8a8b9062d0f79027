# SPDX-License-Identifier: Apache-2.0
"""Block whose function stays in Python, `@gpac.block(native=False)`: C code that contains the function as bytes and calls it.

The function is sent with the block to the process of its processor, where `interpreting` restores it before the first firing. Under
the virtual clock the program's own function is called.
"""

from __future__ import annotations

import ast
import base64
import copy
import hashlib
import importlib
import json
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import DefinitionError
from .checking import RETURNS_A_VALUE, tells_written
from .interpreting import KNOWN
from .items import Item, Refusing
from .shim import declared, quoted
from .words import Condition

LATE = "late"

_C = Path(__file__).with_name("interpreted.c")


def source(name: str, doc: str, items: list[Item], function: Callable[..., Any], deadline_s: float | None, file: str, line: int) -> str:
    """Returns the text of a C file with one block that calls the `function` created by `returning`."""
    payload = _payload(name, items, function, line, file)
    words = [declared(item) for item in items]
    if deadline_s is not None:
        text = "the function exceeded its deadline; the value is its duration, s"
        words.append(f'condition_of_default(double, {LATE}, {deadline_s!r}, {quoted(text)}, "s")')
    here = f"#line {line} {quoted(file)}"
    conditions = [i.name for i in items if isinstance(i.word, Condition)]
    given = ", ".join(f"&opengpac_reports_{i.name}" if i.name in conditions else f"(void *)&self->{i.name}" for i in items)
    return "\n".join([
        f"#define OPENGPAC_NAME {quoted(name)}",
        f"#define OPENGPAC_PAYLOAD {' '.join(quoted(payload[at : at + 4000]) for at in range(0, len(payload), 4000))}",
        f"#define OPENGPAC_BOOTSTRAP {quoted(_bootstrap())}",
        _C.read_text(),
        here,
        f"FUNCTION_BLOCK({name}, {quoted(doc)}, {', '.join(words)})",
        here,
        "{",
        *(f"    bool opengpac_reports_{c} = 0;" for c in conditions),
        f"    void *opengpac_given[] = {{{given}}};",
        "    double opengpac_took = 0;",
        "    const char *opengpac_problem = opengpac_call_python(invocation, opengpac_given, &opengpac_took);",
        "    if (opengpac_problem) return opengpac_outcome_of(OG_THREW | (uint64_t)(uintptr_t)opengpac_problem << 8);",
        *(f"    if (opengpac_reports_{c}) report({c});" for c in conditions),
        *([f"    if (opengpac_took > self->{LATE}) report_value({LATE}, opengpac_took);"] if deadline_s is not None else []),
        "    return OK;",
        "}",
        "",
    ])  # fmt: skip


def returning(tree: ast.FunctionDef, items: list[Item], space: dict[str, Any], file: str, refusing: Refusing) -> Callable[..., Any]:
    """Returns the function, modified to return the values of its outputs, states and conditions at each exit. Line numbers remain those
    of the user's file.

    `space` is the module's namespace; changes that the function makes to it persist.
    """
    made = copy.deepcopy(tree)
    made.decorator_list, made.returns = [], None
    made.args = ast.arguments(posonlyargs=[], args=[ast.arg(a.arg) for a in _arguments(tree)], kwonlyargs=[], kw_defaults=[], defaults=[])
    held = ast.Tuple([ast.Name(i.name, ast.Load()) for i in items if i.written], ast.Load())
    end = ast.copy_location(ast.Return(held), tree.body[-1])
    made.body = [_Ends(held, refusing).visit(statement) for statement in made.body] + [end]
    module = ast.fix_missing_locations(ast.Module([made], []))
    own: dict[str, Any] = {}
    exec(compile(module, file, "exec", dont_inherit=True), space, own)
    return own[tree.name]


def _arguments(tree: ast.FunctionDef) -> list[ast.arg]:
    return [*tree.args.posonlyargs, *tree.args.args, *tree.args.kwonlyargs]


class _Ends(ast.NodeTransformer):
    """Makes each `return` of the function itself return the values of its outputs, states and conditions."""

    def __init__(self, held: ast.Tuple, refusing: Refusing) -> None:
        self._held = held
        self._refusing = refusing

    def visit_Return(self, node: ast.Return) -> ast.AST:
        if not tells_written(node, [name.id for name in self._held.elts if isinstance(name, ast.Name)]):
            self._refusing(node.lineno, *RETURNS_A_VALUE)
        return ast.copy_location(ast.Return(copy.deepcopy(self._held)), node)

    def visit_Yield(self, node: ast.Yield) -> ast.AST:
        self._refusing(node.lineno, "it is a generator", "store its state in a State")

    visit_YieldFrom: Any = visit_Yield

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        return node

    visit_AsyncFunctionDef: Any = visit_FunctionDef
    visit_Lambda: Any = visit_FunctionDef
    visit_ClassDef: Any = visit_FunctionDef


def _payload(name: str, items: list[Item], function: Callable[..., Any], line: int, file: str) -> str:
    """Returns the function and its items, serialised as text."""
    try:
        cloudpickle = importlib.import_module("cloudpickle")
    except ImportError as why:
        text = f"block '{name}' requires cloudpickle, which is not installed ({why})"
        raise DefinitionError(text, remedy="run pip install 'opengpac[python]'") from None
    refusing = Refusing(file, name)
    try:
        pickled = cloudpickle.dumps(function)
    except Exception as why:
        remedy = "create it inside the function, at its first call, or in a module that the function imports"
        refusing(line, f"an object of its module cannot be sent to a process: {why}", remedy)
    forms = [(i.name, i.element, i.shape, i.written, isinstance(i.word, Condition)) for i in items]
    key = hashlib.sha256(pickled + repr(forms).encode()).hexdigest()
    KNOWN[key] = function
    return base64.b64encode(pickle.dumps((key, forms, pickled))).decode()


def _bootstrap() -> str:
    """Returns the program that Python runs when the block's code is loaded: it sets up the same module paths, and restores the function."""
    return f"""
import sys
try:
    sys.path += [path for path in {json.dumps([path for path in sys.path if path])} if path not in sys.path]
    from opengpac.python.interpreting import load
    load(at)
except BaseException as why:
    import ctypes
    told = f"its function cannot be created there: {{type(why).__name__}}: {{why}}".encode()[:199]
    ctypes.memmove(at + 16, told, len(told))
"""
