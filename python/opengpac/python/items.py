# SPDX-License-Identifier: Apache-2.0
"""Extracts the block's items from a function's signature, and reports its errors."""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, NoReturn, get_args, get_origin, get_type_hints

import numpy as np

from .. import _native
from ..errors import DefinitionError, UnitMismatch, ValueRefused, refusals
from ..refusals.source_location import Place
from .words import Condition, Input, Invocation, Output, State, Word

PYTHON = {float: "double", int: "int64_t", bool: "bool"}
WIDTHS = {"double": "float64", "float": "float32", "bool": "bool_"} | {
    f"{sign}int{bits}_t": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}
"""C element types, and their names in NumPy and numba."""

_NO_UNIT = "px/counts"
"""Unit that matches no other unit. A check against it reports a known unit as different, and an unknown one as unknown."""

_TYPE = re.compile(r"\s*(\w+)\s*((?:\[\s*\d+\s*\])*)\s*")


@dataclass(frozen=True)
class Item:
    """One argument: its `word`, the C `element` type, the `shape` of an array, and the `default` in C, or None."""

    name: str
    word: Word | Condition
    element: str
    shape: tuple[int, ...]
    default: str | None
    line: int

    @property
    def type(self) -> str:
        """C type of a single value, without the elements of a history."""
        history = self.word.history if isinstance(self.word, Input) else 0
        return self.element + "".join(f"[{n}]" for n in (self.shape[1:] if history else self.shape))

    @property
    def written(self) -> bool:
        """True if the function may change the item."""
        return isinstance(self.word, Output | State | Condition)


class Refusing:
    """Refuses constructs of a function, and reports their lines."""

    def __init__(self, file: str, name: str) -> None:
        self.file = file
        self.name = name

    def __call__(self, line: int, message: str, remedy: str, kind: type[DefinitionError | UnitMismatch] = DefinitionError) -> NoReturn:
        raise kind(f"block '{self.name}': {message}", remedy=remedy, place=Place(self.file, line)) from None


def items_of(function: Callable[..., Any], tree: ast.FunctionDef, refusing: Refusing) -> tuple[list[Item], str | None]:
    """Returns the items of a function, and the name of the argument that receives the invocation."""
    lines = {a.arg: a.lineno for a in [*tree.args.posonlyargs, *tree.args.args, *tree.args.kwonlyargs]}
    for star in (tree.args.vararg, tree.args.kwarg):
        if star:
            refusing(star.lineno, f"'*{star.arg}' cannot be an item of a block", "name each input, output, parameter and state")
    try:
        hints = get_type_hints(function, include_extras=True)
    except (NameError, AttributeError, TypeError) as why:
        refusing(tree.lineno, f"its annotations cannot be read: {why}", "use names of the module level in annotations")
    items: list[Item] = []
    invocation = None
    for name, formal in inspect.signature(function).parameters.items():
        if hints.get(name) is Invocation:
            invocation = name
            continue
        items.append(_item(name, hints.get(name), formal.default, lines[name], refusing))
    if not any(isinstance(item.word, Output | Condition) for item in items):
        refusing(tree.lineno, "it has neither an output nor a condition", 'declare one: y: Annotated[float, Output("what it is")]')
    if len(items) > 32:
        refusing(
            items[32].line, f"it has {len(items)} items, but a block has at most 32", 'combine several into an array, type="double[6]"'
        )
    return items, invocation


def _item(name: str, hint: Any, default: Any, line: int, refusing: Refusing) -> Item:
    if hint is None:
        refusing(line, f"argument '{name}' has no annotation", f'write {name}: Annotated[float, Input("what it is", "unit")]')
    words = [a for a in get_args(hint)[1:] if isinstance(a, Word | Condition)] if get_origin(hint) is Annotated else []
    if len(words) != 1 or type(words[0]) is Word:
        refusing(
            line,
            f"the annotation of '{name}' must specify exactly one of input, output, state, parameter and condition",
            f'write {name}: Annotated[float, Input("what it is", "unit")]',
        )
    if _native.is_word_of_c(name):
        refusing(line, f"'{name}' is reserved by C or OpenGPAC", f"choose another name, for example '{name.strip('_')}_value'")
    word = words[0]
    _check_unit(name, word, line, refusing)
    element, shape = _type_of(name, word, get_args(hint)[0], line, refusing)
    if isinstance(word, Input):
        _check_mode(name, word, line, refusing)
        if word.history:
            shape = (word.history, *shape)
    if isinstance(word, Output) and word.ratio < 0:
        refusing(line, f"the ratio of '{name}' must be at least 1, not {word.ratio}", "write ratio=10, for example")
    return Item(name, word, element, shape, _default(name, word, element, shape, default, line, refusing), line)


def _check_unit(name: str, word: Word | Condition, line: int, refusing: Refusing) -> None:
    """Refuses an unknown unit immediately rather than when a verb uses the block."""
    if not isinstance(word, Word) or not word.unit:
        return
    for unit in word.unit.split("|"):
        try:
            with refusals:
                _native.number_in(f"1 {unit}", _NO_UNIT)
        except ValueRefused as why:
            refusing(line, f"unit '{word.unit}' of '{name}' is unknown", why.remedy or "write 'N.m/rad', for example", UnitMismatch)
        except UnitMismatch:
            pass


def _type_of(name: str, word: Word | Condition, python: Any, line: int, refusing: Refusing) -> tuple[str, tuple[int, ...]]:
    if isinstance(word, Condition):
        if python is not bool:
            refusing(
                line,
                f"condition '{name}' must be annotated as bool, not {getattr(python, '__name__', python)}",
                "write {name}: Annotated[bool, Condition('…')]",
            )
        return "bool", ()
    remedy = 'annotate it as float, int or bool, or as numpy.ndarray with type="double[6]"'
    text = word.type or PYTHON.get(python) if not isinstance(python, list) else word.type
    if not text:
        refusing(line, f"the type of '{name}' is {getattr(python, '__name__', python)}, which a port cannot have", remedy)
    if re.search(r"\[\s*[A-Za-z_]\w*\s*\]", text):
        remedy = 'use a fixed number, type="double[6]", or write the block in C with size(n, 1, 16) for any number of elements'
        refusing(line, f"the type of '{name}' is '{text}', whose length is not a number", remedy)
    found = _TYPE.fullmatch(text)
    if found is None or found[1] not in WIDTHS:
        remedy = f"use one of {', '.join(WIDTHS)}, or an array of one, 'double[6]'; replace a struct by one item for each member"
        refusing(line, f"the type of '{name}' cannot be '{text}'", remedy)
    shape = tuple(int(n) for n in re.findall(r"\d+", found[2]))
    if 0 in shape:
        refusing(line, f"the type of '{name}' is '{text}', which has no elements", "make each length at least 1")
    return found[1], shape


def _check_mode(name: str, word: Input, line: int, refusing: Refusing) -> None:
    if word.mode not in ("synchronous", "asynchronous"):
        refusing(line, f"the mode of input '{name}' cannot be '{word.mode}'", "use 'synchronous', 'asynchronous' or ratio=n")
    if word.ratio < 0 or not 0 <= word.history <= 4096:
        refusing(
            line,
            f"input '{name}' cannot have ratio={word.ratio}, history={word.history}",
            "use a ratio of at least 1 and a history of at most 4096",
        )
    if (word.ratio > 0) + (word.history > 0) + (word.mode == "asynchronous") > 1:
        refusing(
            line, f"input '{name}' can have only one of ratio, history and mode", "remove all but one; a history is always asynchronous"
        )


def _default(
    name: str, word: Word | Condition, element: str, shape: tuple[int, ...], default: Any, line: int, refusing: Refusing
) -> str | None:
    if default is inspect.Parameter.empty:
        return None
    if isinstance(word, Output) or (isinstance(word, Condition) and default is not False):
        refusing(line, f"'{name}' is an output or condition, which cannot have a default", "remove it; only a State has an initial value")
    if isinstance(word, Input) and (word.ratio or word.history):
        refusing(line, f"input '{name}' has a ratio or history and cannot have a default", "remove it")
    try:
        values = np.asarray(default)
    except ValueError:
        values = np.asarray(None)
    kinds = {"bool": "b", "double": "iuf", "float": "iuf"}.get(element, "iu")
    if values.dtype.kind not in kinds or (values.shape not in ((), shape)):
        type_text = element + "".join(f"[{n}]" for n in shape)
        refusing(line, f"the default of '{name}' must be a value of {type_text}, not {default!r}", f"write a value of {type_text}")
    if element not in ("double", "float", "bool"):
        limits = np.iinfo(WIDTHS[element])
        if values.size and (int(values.min()) < limits.min or int(values.max()) > limits.max):
            refusing(
                line, f"the default of '{name}' is {default!r}, which is out of range for {element}", f"write {limits.min} to {limits.max}"
            )
    if not all(math.isfinite(v) for v in values.ravel()):
        refusing(line, f"the default of '{name}' must be finite, not {default!r}", "write finite numbers")
    flat = np.broadcast_to(values, shape).ravel().tolist()
    texts = [str(v).lower() if element == "bool" else repr(float(v)) if element in ("double", "float") else str(v) for v in flat]
    return texts[0] if len(texts) == 1 else f"({', '.join(texts)})"
