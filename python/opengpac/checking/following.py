# SPDX-License-Identifier: Apache-2.0
"""Executes a program so that an error does not end it: each refusal is recorded, and execution continues with the next statement.

The names that a refused statement would have bound are `Absent`. A statement that needs an absent value is skipped silently, because
its error would only repeat the first one. Errors inside a `try` with handlers are left to the program.

An ordinary Python exception aborts a whole top-level statement of the module, and is reported with the lines that were skipped.
Inside functions and loops it propagates as in a run, since the program may catch it there.
"""

from __future__ import annotations

import ast
import sys
import types
from collections.abc import Callable
from typing import Any, NoReturn

from ..errors import Error

_ERROR, _NOTE, _ABSENT = "__gpac_errors__", "__gpac_note__", "__gpac_absent__"
_CAUGHT, _LOST, _BROKEN = "__gpac_error__", "__gpac_lost__", "__gpac_exception__"
_SIMPLE = (ast.Assign, ast.AnnAssign, ast.AugAssign, ast.Expr, ast.Return, ast.Delete, ast.Assert)
_IMPORT = (ast.Import, ast.ImportFrom)
_OWN = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.For, ast.AsyncFor, ast.While)
"""Compound statements within which an exception is not reported immediately."""
_COMPOUND = (ast.With, ast.AsyncWith, ast.For, ast.AsyncFor, ast.If, ast.While, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Missing(AttributeError):
    """Raised by a statement that uses a value left undefined by an earlier error. Derives from `AttributeError` so that `hasattr` works."""


class Absent:
    """Placeholder for a value that an earlier error left undefined; any use of it raises `Missing`."""

    def _missing(self, *_: Any, **__: Any) -> NoReturn:
        raise Missing

    __call__ = __getitem__ = __setitem__ = __iter__ = __enter__ = __exit__ = __len__ = __bool__ = __float__ = __int__ = _missing
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rshift__ = __rrshift__ = __matmul__ = _missing
    __lt__ = __gt__ = __le__ = __ge__ = __await__ = __aenter__ = __aexit__ = __mro_entries__ = _missing

    def __getattr__(self, name: str) -> NoReturn:
        raise Missing

    def __repr__(self) -> str:
        return "<left out: an earlier error>"


ABSENT = Absent()


def follow(
    path: str,
    note: Callable[[Error], None],
    names: dict[str, Any] | None = None,
    broken: Callable[[Exception, int, int], None] | None = None,
) -> None:
    """Executes the program in the file at `path` as `__main__`. Calls `note` for each refused statement, and `broken` for each statement
    that another exception aborted, with its first and last line. Stores the names that the program binds in `names`.

    `SystemExit` and syntax errors propagate as in a run.
    """
    with open(path, "rb") as file:
        source = file.read()
    tree = _Guarded().visit(ast.parse(source, path))
    module = types.ModuleType("__main__")

    def noted(error: Exception) -> None:
        if isinstance(error, Error):
            note(error)

    def lost(error: Exception, first: int, last: int) -> None:
        if broken is None:
            raise error
        broken(error, first, last)

    module.__dict__.update({"__file__": path, _ERROR: (Error, Missing), _NOTE: noted, _ABSENT: ABSENT, _LOST: lost, _BROKEN: Exception})
    before = sys.modules.get("__main__")
    sys.modules["__main__"] = module
    try:
        exec(compile(ast.fix_missing_locations(tree), path, "exec"), module.__dict__)
    finally:
        if names is not None:
            names.update({name: value for name, value in vars(module).items() if not name.startswith("__")})
        if before is not None:
            sys.modules["__main__"] = before


class _Guarded(ast.NodeTransformer):
    """Wraps each statement in a separate `try`."""

    def __init__(self) -> None:
        self._inside = 0
        """Number of `_OWN` statements that enclose the current one."""

    def visit_Try(self, node: ast.Try) -> ast.AST:
        if node.handlers:
            return node if self._inside else _guard(node, broken=True)
        self.generic_visit(node)
        return node

    def visit(self, node: ast.AST) -> Any:
        own = isinstance(node, _OWN)
        top = self._inside == 0
        if isinstance(node, _COMPOUND):
            self._inside += own
            self.generic_visit(node)
            self._inside -= own
            return _guard(node, broken=top)
        if isinstance(node, _SIMPLE) or (isinstance(node, _IMPORT) and getattr(node, "module", "") != "__future__"):
            return _guard(node, broken=top)
        return super().visit(node)


def _guard(statement: ast.stmt, broken: bool) -> ast.stmt:
    """Guards a statement: a refusal is recorded, and the statement's targets become absent. If `broken`, other exceptions are reported
    too."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return statement
    absent = [ast.Assign([ast.Name(name, ast.Store())], ast.Name(_ABSENT, ast.Load())) for name in _names(statement)]
    leaves = [ast.Return(ast.Name(_ABSENT, ast.Load()))] if isinstance(statement, ast.Return) else []
    handlers = [ast.ExceptHandler(ast.Name(_ERROR, ast.Load()), _CAUGHT, [ast.Expr(_call(_NOTE)), *absent, *leaves])]
    if broken:
        lines = (statement.lineno, statement.end_lineno or statement.lineno)
        told = ast.Expr(_call(_LOST, *(ast.Constant(line) for line in lines)))
        handlers.append(ast.ExceptHandler(ast.Name(_BROKEN, ast.Load()), _CAUGHT, [told, *absent]))
    guarded = ast.Try([statement], handlers, [], [])
    for handler in handlers:
        for new in ast.walk(handler):
            ast.copy_location(new, statement)
    return ast.copy_location(guarded, statement)


def _call(name: str, *more: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), [ast.Name(_CAUGHT, ast.Load()), *more], [])


def _names(statement: ast.stmt) -> list[str]:
    """Returns the names that a statement binds, excluding those of nested statements."""
    match statement:
        case ast.ClassDef() | ast.FunctionDef() | ast.AsyncFunctionDef():
            return [statement.name]
        case ast.Import() | ast.ImportFrom():
            return [(alias.asname or alias.name).split(".")[0] for alias in statement.names if alias.name != "*"]
        case ast.Assign():
            targets: list[ast.expr] = statement.targets
        case ast.AnnAssign() if statement.value is not None:
            targets = [statement.target]
        case ast.With() | ast.AsyncWith():
            targets = [item.optional_vars for item in statement.items if item.optional_vars is not None]
        case _:
            return []
    return [n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
