# SPDX-License-Identifier: Apache-2.0
"""Kinds of arguments of a block's function: `u: Annotated[float, Input("measured position", "rad")]`.

The annotated type is the one that a type checker sees in the body. It determines the block's C type (`float` is `double`, `int` is
`int64_t`, `bool` is `bool`), unless the C type is declared: `type="float"`, or `type="double[6]"` with the annotation
`numpy.ndarray`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Word:
    """Base class of all items: `doc`, `unit`, and the C `type` if the annotated type does not determine it."""

    doc: str = ""
    unit: str = ""
    type: str = ""


@dataclass(frozen=True)
class Input(Word):
    """An input. `mode` is `"synchronous"` or `"asynchronous"`. With `ratio=n` its writer updates it once in n invocations; with
    `history=n` it contains the n most recent values, oldest first. The argument's default, if any, is its value while it is unbound."""

    mode: str = "synchronous"
    ratio: int = 0
    history: int = 0


@dataclass(frozen=True)
class Output(Word):
    """An output, which is the final value of its argument. With `ratio=n` it is stored on every nth invocation; with `nonfinite` it may
    be infinite or NaN. Its initial value is the value of the previous invocation, or 0 in the first one."""

    ratio: int = 0
    nonfinite: bool = False


@dataclass(frozen=True)
class State(Word):
    """A state, which is preserved between invocations. Its initial value is the argument's default, or 0. With `keep` it survives a
    restart of the instance."""

    keep: bool = False


@dataclass(frozen=True)
class Parameter(Word):
    """A parameter. Its default is the argument's."""


@dataclass(frozen=True)
class Condition:
    """A condition: false at the start of each invocation, reported if the function sets it to true. Annotated as `bool`."""

    doc: str = ""


@dataclass(frozen=True)
class Invocation:
    """The invocation: its `number` from 0, running time `time` in seconds and `time_ns` in nanoseconds, and the release time of the
    firing, `now_ns`."""

    number: int
    time: float
    time_ns: int
    now_ns: int
