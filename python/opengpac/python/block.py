# SPDX-License-Identifier: Apache-2.0
"""`@gpac.block`: a Python function becomes a function block. Compiled once for each content, and kept for later processes."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, ParamSpec

from ..blocks import Block
from ..errors import DefinitionError, ModuleError, UnitMismatch, refuse
from ..kept import interface, kept
from ..places import Place
from . import compiling, shim
from .checking import check_body
from .items import Item, Refusing, items_of
from .rewriting import rewritten

P = ParamSpec("P")


class PythonBlock(Block, Generic[P]):
    """A block that was written in Python. Made by `@gpac.block`. `function` is the function as written, for comparison."""

    def __init__(self, interface: Mapping[str, Any], module: str, function: Callable[P, None]) -> None:
        super().__init__(interface, module)
        self.function = function


def block(function: Callable[P, None]) -> PythonBlock[P]:
    """A function block from a function whose arguments are annotated as its items.

    Outputs, states and conditions are arguments that the function assigns to; what they hold at its end is published, together.
    An exception that Python would raise (a division by zero, an index beyond an array) is a fault of the invocation. The docstring is the
    block's description. Numba compiles it, with no interpreter: what cannot be compiled raises `DefinitionError` with its line and
    what to write instead. Defining it again, as a notebook does, redefines the block.

    >>> from typing import Annotated
    >>> import opengpac as gpac
    >>> from opengpac.python import Input, Output, Parameter
    >>> @gpac.block
    ... def lowpass(u: Annotated[float, Input("raw")], y: Annotated[float, Output("smooth")], alpha: Annotated[float, Parameter()] = 0.1):
    ...     '''First-order low-pass filter: y += alpha (u - y).'''
    ...     y += alpha * (u - y)
    >>> lowpass.run(alpha=0.5, u=[1.0, 1.0]).y
    array([0.5 , 0.75])
    """
    tree, file, text = _parsed(function)
    refusing = Refusing(file, tree.name)
    items, invocation = items_of(function, tree, refusing)
    found = inspect.getclosurevars(function)
    names = {**found.globals, **found.nonlocals}
    check_body(tree, items, invocation, names, refusing)
    doc = (ast.get_docstring(tree) or tree.name).strip()
    constants = {name: repr(value) for name, value in sorted(names.items()) if isinstance(value, bool | int | float)}
    key = [compiling.VERSION, compiling.CPU, file, tree.lineno, text, constants, repr(items)]

    def source() -> str:
        made = rewritten(tree, items, invocation, names, file)
        assembly = compiling.assembly(made, items, file, refusing, tree.lineno)
        return shim.source(tree.name, doc, items, assembly, file, tree.lineno)

    found = kept("python-blocks", tree.name, key, source)
    return PythonBlock(_interface(function, found, items, refusing), str(found), function)


def _parsed(function: Callable[..., Any]) -> tuple[ast.FunctionDef, str, str]:
    """The function's syntax tree with the lines of its file, the file, and its text."""
    if not inspect.isfunction(function):
        refuse(DefinitionError, f"@gpac.block is on {function!r}, not on a function", "write @gpac.block over a def")
    code = function.__code__
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):
        refuse(DefinitionError, f"the source of '{function.__name__}' is not to be had", "write it into a file or a notebook's cell")
    text = textwrap.dedent("".join(lines))
    tree = ast.parse(text).body[0] if not text.lstrip().startswith("lambda") and function.__name__ != "<lambda>" else None
    if not isinstance(tree, ast.FunctionDef):
        place = Place(code.co_filename, first)
        raise DefinitionError(f"'{function.__name__}' is not a plain function", remedy="write @gpac.block over a def", place=place)
    ast.increment_lineno(tree, first - 1)
    return tree, code.co_filename, text


def _interface(function: Callable[..., Any], found: Path, items: list[Item], refusing: Refusing) -> Mapping[str, Any]:
    """The block's interface as the real-time system reads it from the compiled code."""
    module = "python" if function.__module__ == "__main__" else function.__module__.replace(".", "_")
    try:
        return interface(f"{module}:{refusing.name}", found)
    except (DefinitionError, UnitMismatch, ModuleError) as why:
        line = next((i.line for i in items if f"'{i.name}'" in why.message), items[0].line)
        raise type(why)(f"block '{refusing.name}': {why.message}", remedy=why.remedy, place=Place(refusing.file, line)) from None


__all__ = ["PythonBlock", "block"]
