# SPDX-License-Identifier: Apache-2.0
"""Implements `@gpac.block`: creates a function block from a Python function. The function is compiled once per content, and cached for
later processes."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, Literal, ParamSpec, overload

from ..definition.blocks import Block
from ..definition.generated_code import interface, kept
from ..errors import DefinitionError, ModuleError, UnitMismatch, refuse
from ..refusals.source_location import Place
from ..values.quantities import Quantity, duration_ns
from . import compiling, interpreted, shim
from .checking import check_body
from .items import Item, Refusing, items_of
from .rewriting import rewritten

P = ParamSpec("P")

KIND = "python-blocks"
"""Category under which the generated code is cached."""


class PythonBlock(Block, Generic[P]):
    """A block written in Python. Created by `@gpac.block`.

    `function` is the original function, for comparison; `native` is True if it was compiled, False if it runs as Python in a separate
    process.
    """

    def __init__(self, interface: Mapping[str, Any], module: str, function: Callable[P, object], native: bool = True) -> None:
        super().__init__(interface, module)
        self.function = function
        self.native = native


@overload
def block(function: Callable[P, object]) -> PythonBlock[P]: ...
@overload
def block(*, native: Literal[True] = True) -> Callable[[Callable[P, object]], PythonBlock[P]]: ...
@overload
def block(*, native: Literal[False], deadline: Quantity | None = None) -> Callable[[Callable[P, object]], PythonBlock[P]]: ...
def block(function: Callable[P, object] | None = None, *, native: bool = True, deadline: Quantity | None = None) -> Any:
    """Creates a function block from a `function` whose arguments are annotated as the block's items.

    Outputs, states and conditions are arguments that the function assigns to; their final values are published together. A Python
    exception (a division by zero, an index out of bounds) is a fault of the invocation. The docstring is the block's description.
    Numba compiles the function, without an interpreter: code that cannot be compiled raises `DefinitionError` with its line and an
    alternative. Defining it again, as in a notebook, redefines the block.

    `@gpac.block(native=False)` leaves it uncompiled, so that it may contain any Python code, including NumPy, PyTorch and OpenCV. It
    runs on a processor of its own, `cell.processor("eyes", process=True)`, at the interval of its activation, and other blocks read
    its values when they arrive. An exception is reported as `fault`, with its text and line; the termination of its process is
    reported as `processor_lost`. With `deadline="40 ms"` the block has a condition `late`, reported by an invocation that took
    longer.
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
    if function is None:
        return lambda function: _made(function, native, deadline)
    return _made(function, native, deadline)


def _made(function: Callable[P, object], native: bool, deadline: Quantity | None) -> PythonBlock[P]:
    tree, file, text = _parsed(function)
    refusing = Refusing(file, tree.name)
    items, invocation = items_of(function, tree, refusing)
    found = inspect.getclosurevars(function)
    names = {**found.globals, **found.nonlocals}
    doc = (ast.get_docstring(tree) or tree.name).strip()
    if native:
        if deadline is not None:
            refusing(tree.lineno, "it has a deadline, but is compiled", "pass a budget when activating it, or native=False here")
        check_body(tree, items, invocation, names, refusing)
        code = _compiled(tree, items, invocation, names, file, text, doc, refusing)
    else:
        code = _interpreted(function, tree, items, file, doc, deadline, found.nonlocals, refusing)
    return PythonBlock(_interface(function, code, items, refusing), str(code), function, native)


def _compiled(
    tree: ast.FunctionDef,
    items: list[Item],
    invocation: str | None,
    names: Mapping[str, Any],
    file: str,
    text: str,
    doc: str,
    refusing: Refusing,
) -> Path:
    """Compiles the block to native code, and returns the file."""
    constants = {name: repr(value) for name, value in sorted(names.items()) if isinstance(value, bool | int | float)}
    key = [compiling.VERSION, compiling.FORM, compiling.CPU, file, tree.lineno, text, constants, repr(items)]

    def source() -> str:
        made = rewritten(tree, items, invocation, names, file)
        body = compiling.compiled(made, items, file, refusing, tree.lineno)
        return shim.source(tree.name, doc, items, body, file, tree.lineno)

    return kept(KIND, tree.name, key, source)


def _interpreted(
    function: Callable[..., Any],
    tree: ast.FunctionDef,
    items: list[Item],
    file: str,
    doc: str,
    deadline: Quantity | None,
    nonlocals: Mapping[str, Any],
    refusing: Refusing,
) -> Path:
    """Generates the code that calls the function, and returns the file."""
    deadline_ns = duration_ns(deadline, f"the deadline of block '{tree.name}'") if deadline is not None else None
    if deadline_ns is not None and deadline_ns <= 0:
        refusing(tree.lineno, f"its deadline must be more than 0 s, not {deadline!r}", "write '1 ms', for example")
    if deadline_ns is not None and any(item.name == interpreted.LATE for item in items):
        refusing(tree.lineno, "it has an item 'late', which is the name of the condition of its deadline", "rename the item")
    if deadline_ns is not None and len(items) >= 32:
        refusing(tree.lineno, "the condition of its deadline would be the 33rd item", "combine several items into an array")
    space = {**function.__globals__, **nonlocals} if nonlocals else function.__globals__
    made = interpreted.returning(tree, items, space, file, refusing)
    source = interpreted.source(tree.name, doc, items, made, deadline_ns * 1e-9 if deadline_ns else None, file, tree.lineno)
    return kept(KIND, tree.name, source, lambda: source)


def _parsed(function: Callable[..., Any]) -> tuple[ast.FunctionDef, str, str]:
    """Returns the function's syntax tree with the lines of its file, the file, and its text."""
    if not inspect.isfunction(function):
        refuse(DefinitionError, f"@gpac.block must decorate a function, not {function!r}", "write @gpac.block above a def")
    code = function.__code__
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):
        refuse(DefinitionError, f"the source of '{function.__name__}' cannot be read", "write it in a file or in a cell of a notebook")
    text = textwrap.dedent("".join(lines))
    tree = ast.parse(text).body[0] if not text.lstrip().startswith("lambda") and function.__name__ != "<lambda>" else None
    if not isinstance(tree, ast.FunctionDef):
        place = Place(code.co_filename, first)
        raise DefinitionError(f"'{function.__name__}' is not a plain function", remedy="write @gpac.block above a def", place=place)
    ast.increment_lineno(tree, first - 1)
    return tree, code.co_filename, text


def _interface(function: Callable[..., Any], found: Path, items: list[Item], refusing: Refusing) -> Mapping[str, Any]:
    """Returns the block's interface as read by the real-time system from the compiled code."""
    module = "python" if function.__module__ == "__main__" else function.__module__.replace(".", "_")
    try:
        return interface(f"{module}:{refusing.name}", found)
    except (DefinitionError, UnitMismatch, ModuleError) as why:
        line = next((i.line for i in items if f"'{i.name}'" in why.message), items[0].line)
        raise type(why)(f"block '{refusing.name}': {why.message}", remedy=why.remedy, place=Place(refusing.file, line)) from None


__all__ = ["PythonBlock", "block"]
