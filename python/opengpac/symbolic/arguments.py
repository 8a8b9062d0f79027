# SPDX-License-Identifier: Apache-2.0
"""Arguments and results of a `casadi.Function` in its block."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NoReturn, TypeAlias

import numpy as np

from .. import _native
from ..errors import DefinitionError, UnitMismatch, did_you_mean, refusals, refuse
from ..python.items import Item
from ..python.words import Condition, Input, Output, Parameter, State
from ..values.quantities import unknown_unit

Given: TypeAlias = str | Input | Output | Condition
Constant: TypeAlias = "float | str | Sequence[float] | np.ndarray"

ITEMS_MAX = 32
DEFAULTS_MAX = 30


@dataclass(frozen=True)
class Side:
    """Inputs or outputs of the function, which form one side of the block."""

    given: Mapping[str, Given]
    side: Literal["input", "output"]


@dataclass(frozen=True)
class Argument:
    """Input or output number `index` of the function: its `item` in the block, or None if omitted; `rows` and `columns`; `places`, the
    positions of its nonzero elements, by row, in CasADi's order; `back`, the input for which this output is the next value."""

    index: int
    name: str
    item: Item | None
    rows: int
    columns: int
    places: tuple[int, ...]
    back: str | None = None

    @property
    def size(self) -> int:
        """Number of elements, including zeros."""
        return self.rows * self.columns

    @property
    def in_order(self) -> bool:
        """True if CasADi's elements are the block's elements, in the same order."""
        return self.places == tuple(range(self.size))


@dataclass(frozen=True)
class Arguments:
    """Inputs and outputs of a function, in the function's order."""

    inputs: list[Argument]
    outputs: list[Argument]

    @property
    def items(self) -> list[Item]:
        """Items of the block."""
        return [a.item for a in (*self.inputs, *self.outputs) if a.item is not None]


def arguments_of(
    block: str,
    function: Any,
    inputs: Side,
    outputs: Side,
    parameters: Mapping[str, Constant],
    states: Mapping[str, str],
    initial: Mapping[str, Any],
) -> Arguments:
    """Returns the inputs and outputs of a function; refuses a function that a block cannot represent."""
    ins = [str(function.name_in(i)) for i in range(function.n_in())]
    outs = [str(function.name_out(i)) for i in range(function.n_out())]
    for what, names, known in (
        ("inputs", inputs.given, ins), ("parameters", parameters, ins), ("states", states, ins),
        ("outputs", outputs.given, outs), ("states", states.values(), outs), ("initial", initial, list(states)),
    ):  # fmt: skip
        for name in names:
            if name not in known:
                text = f"{what}= of block '{block}' names '{name}', but {function.name()} has {', '.join(known) or 'none'}"
                refuse(DefinitionError, text, did_you_mean(name, known) or f"use names of the function in {what}=")
    for name in ins:
        if (name in inputs.given) + (name in parameters) + (name in states) > 1:
            refuse(DefinitionError, f"'{name}' of block '{block}' is listed twice", "make it either an input, a parameter or a state")
    back = {output: state for state, output in states.items()}
    if len(back) < len(states):
        refuse(DefinitionError, f"two states of block '{block}' use the same output", "give each state its own output")
    made = Arguments(
        [_input(block, function, i, name, inputs, parameters, states, initial) for i, name in enumerate(ins)],
        [_output(block, function, i, name, outputs, back.get(name)) for i, name in enumerate(outs)],
    )
    _check_states(block, made)
    if not any(isinstance(item.word, Output | Condition) for item in made.items):
        refuse(DefinitionError, f"block '{block}' has no output", "name an output in outputs=")
    if len(made.items) > ITEMS_MAX:
        text = f"block '{block}' has {len(made.items)} items, but a block has at most {ITEMS_MAX}"
        refuse(DefinitionError, text, "combine several into a vector: casadi.vertcat(a, b)")
    return made


def _input(
    block: str,
    function: Any,
    index: int,
    name: str,
    side: Side,
    parameters: Mapping[str, Constant],
    states: Mapping[str, str],
    initial: Mapping[str, Any],
) -> Argument:
    sparsity = function.sparsity_in(index)
    rows, columns = sparsity.shape
    places = tuple(r * columns + c for c in range(columns) for r in range(rows))
    if rows * columns == 0:
        if name in side.given or name in parameters or name in states:
            refuse(DefinitionError, f"input '{name}' of block '{block}' is empty ({rows} x {columns})", "remove it")
        return Argument(index, name, None, rows, columns, ())
    if not sparsity.is_dense():
        text = f"input '{name}' of block '{block}' is sparse: {sparsity.nnz()} of {rows} x {columns} elements"
        refuse(DefinitionError, text, "make it dense: a casadi.Function whose input is casadi.MX.sym(name, rows, columns)")
    shape = _shape(rows, columns)
    if name in parameters:
        values, unit = _constant(block, name, parameters[name])
        item = Item(name, Parameter("parameter", unit), "double", shape, _default(block, name, shape, values), 0)
    elif name in states:
        item = Item(name, State("state"), "double", shape, _default(block, name, shape, initial.get(name, 0.0)), 0)
    else:
        word = side.given.get(name, Input("input"))
        word = Input("input", word) if isinstance(word, str) else word
        if not isinstance(word, Input):
            _wrong_word(block, name, word, "a unit or Input(…)")
        if word.history and shape[:1] != (word.history,):
            text = f"input '{name}' of block '{block}' has history={word.history}, but the function takes {rows} x {columns}"
            refuse(DefinitionError, text, f"give it {word.history} rows, or set history={rows}")
        item = Item(name, _checked(block, name, word), "double", shape, None, 0)
    _check_name(block, name)
    return Argument(index, name, item, rows, columns, places)


def _output(block: str, function: Any, index: int, name: str, side: Side, back: str | None) -> Argument:
    sparsity = function.sparsity_out(index)
    rows, columns = sparsity.shape
    row, column = sparsity.row(), sparsity.get_col()
    places = tuple(r * columns + c for r, c in zip(row, column, strict=True))
    if rows * columns == 0 or (back is not None and name not in side.given):
        if name in side.given:
            refuse(DefinitionError, f"output '{name}' of block '{block}' is empty ({rows} x {columns})", "remove it")
        return Argument(index, name, None, rows, columns, places, back)
    word = side.given.get(name, Output("output"))
    word = Output("output", word) if isinstance(word, str) else word
    if not isinstance(word, Output | Condition):
        _wrong_word(block, name, word, "a unit, Output(…) or Condition(…)")
    if isinstance(word, Condition):
        if rows * columns != 1:
            text = f"condition '{name}' of block '{block}' must be a scalar output, not {rows} x {columns}"
            refuse(DefinitionError, text, "use a scalar that is not 0 when the condition is reported")
        item = Item(name, word, "bool", (), None, 0)
    else:
        item = Item(name, _checked(block, name, word), "double", _shape(rows, columns), None, 0)
    _check_name(block, name)
    return Argument(index, name, item, rows, columns, places, back)


def _check_states(block: str, made: Arguments) -> None:
    by_name = {a.name: a for a in made.inputs}
    for output in made.outputs:
        state = by_name.get(output.back or "")
        if state is not None and (state.rows, state.columns) != (output.rows, output.columns):
            text = f"state '{state.name}' of block '{block}' is {state.rows} x {state.columns}, but its next value '{output.name}' is"
            refuse(DefinitionError, f"{text} {output.rows} x {output.columns}", "give both the same shape")


def _checked(block: str, name: str, word: Any) -> Any:
    if word.type not in ("", "double"):
        refuse(DefinitionError, f"'{name}' of block '{block}' cannot have type={word.type!r}", "remove it: the function defines the type")
    if isinstance(word, Input) and (word.mode not in ("synchronous", "asynchronous") or word.ratio < 0 or not 0 <= word.history <= 4096):
        text = f"input '{name}' of block '{block}' cannot have mode='{word.mode}', ratio={word.ratio}, history={word.history}"
        refuse(DefinitionError, text, "use mode 'synchronous' or 'asynchronous', a ratio of at least 1, and a history of at most 4096")
    remedy = unknown_unit(word.unit) if word.unit else None
    if remedy is not None:
        refuse(UnitMismatch, f"unit '{word.unit}' of '{name}' of block '{block}' is unknown", remedy)
    if isinstance(word, Output) and word.ratio < 0:
        refuse(
            DefinitionError,
            f"the ratio of output '{name}' of block '{block}' must be at least 1, not {word.ratio}",
            "write ratio=10, for example",
        )
    return word if word.doc else dataclasses.replace(word, doc=name)


def _wrong_word(block: str, name: str, word: Any, wanted: str) -> NoReturn:
    refuse(DefinitionError, f"'{name}' of block '{block}' cannot be {word!r}", f"pass {wanted}")


def _check_name(block: str, name: str) -> None:
    if not name.isidentifier() or not name.isascii() or _native.is_word_of_c(name) or name.startswith("casadi_"):
        text = f"'{name}' of block '{block}' is reserved by C, CasADi or OpenGPAC, or not a valid name in C"
        refuse(DefinitionError, text, "name the function's inputs and outputs: casadi.Function('law', [x], [u], ['state'], ['force'])")


def _shape(rows: int, columns: int) -> tuple[int, ...]:
    """Returns the shape of the port: a scalar, a vector (row or column), or a matrix."""
    if rows == columns == 1:
        return ()
    return (rows * columns,) if 1 in (rows, columns) else (rows, columns)


def _constant(block: str, name: str, given: Constant) -> tuple[Any, str]:
    """Returns the value of a parameter, and its unit if it is a text with a unit."""
    if not isinstance(given, str):
        return given, ""
    number, _, unit = given.strip().partition(" ")
    if not unit:
        refuse(
            DefinitionError,
            f"parameter '{name}' of block '{block}' must be a number with a unit, not {given!r}",
            "write '2 N/m', for example",
        )
    if unknown_unit(unit.strip()) is not None:
        refuse(
            UnitMismatch,
            f"unit '{unit.strip()}' of parameter '{name}' of block '{block}' is unknown",
            unknown_unit(unit.strip()) or "",
        )
    with refusals:
        return _native.number_in(f"{number} {unit.strip()}", unit.strip()), unit.strip()


def _default(block: str, name: str, shape: tuple[int, ...], given: Any) -> str:
    """Formats the numbers of a default as C code."""
    try:
        values = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        values = np.asarray(np.nan)
    if not np.isfinite(values).all() or values.shape not in ((), shape):
        wanted = "".join(f"[{n}]" for n in shape)
        refuse(
            DefinitionError,
            f"the initial value of '{name}' of block '{block}' cannot be {given!r}",
            f"pass finite numbers of double{wanted}",
        )
    # C pads with zeros.
    texts = [repr(float(v)) for v in np.trim_zeros(np.broadcast_to(values, shape).ravel(), "b")] or ["0"]
    if len(texts) > DEFAULTS_MAX:
        text = (
            f"the initial value of '{name}' of block '{block}' has {len(texts)} numbers, but a declaration "
            f"may contain at most {DEFAULTS_MAX} before the trailing zeros"
        )
        refuse(DefinitionError, text, "start with 0, and add the numbers in the function")
    return texts[0] if len(texts) == 1 else f"({', '.join(texts)})"
