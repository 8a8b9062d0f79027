# SPDX-License-Identifier: Apache-2.0
"""Kinds of arguments of a block's function: `u: Annotated[float, Input("measured position", "rad")]`.

The annotated type is the one that a type checker sees in the body. The block's C type follows from it (`float` is `double`, `int` is
`int64_t`, `bool` is `bool`), or is declared: `type="float"`, `type="double[6]"`, annotated as `numpy.ndarray`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Word:
    """Common part of all items: `doc`, `unit`, and the C `type` if the annotated type does not determine it."""

    doc: str = ""
    unit: str = ""
    type: str = ""


@dataclass(frozen=True)
class Input(Word):
    """An input. `mode` is `"synchronous"` or `"asynchronous"`; `ratio=n`: its writer updates once in n invocations; `history=n`: the
    last n values, the oldest first. A default of the argument is its value while it is unbound."""

    mode: str = "synchronous"
    ratio: int = 0
    history: int = 0


@dataclass(frozen=True)
class Output(Word):
    """An output: the final value of its argument. `ratio=n`: stored on every nth invocation; `nonfinite`: it may be infinite or not a
    number. Its initial value is that of the previous invocation, 0 in the first one."""

    ratio: int = 0
    nonfinite: bool = False


@dataclass(frozen=True)
class State(Word):
    """Memory between invocations; the argument's default is its initial value, else 0. `keep`: it survives a new start."""

    keep: bool = False


@dataclass(frozen=True)
class Parameter(Word):
    """A parameter; the argument's default is its default."""


@dataclass(frozen=True)
class Condition:
    """A condition: false at the start of each invocation, reported if the function sets it to true. Annotated as `bool`."""

    doc: str = ""


@dataclass(frozen=True)
class Invocation:
    """The invocation: `number` from 0, running time `time` in seconds and `time_ns`, release time of the firing `now_ns`."""

    number: int
    time: float
    time_ns: int
    now_ns: int
