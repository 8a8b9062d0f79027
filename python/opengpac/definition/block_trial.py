# SPDX-License-Identifier: Apache-2.0
"""Runs a single block without a system: `block.run(alpha=0.1, u=array).y`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from .. import _native
from ..errors import CallError, OutOfRange, did_you_mean, refusals, refuse
from ..refusals.argument_types import whole
from ..values.arrays import np
from ..values.encoding import plain
from ..values.quantities import Quantity, duration_ns

if TYPE_CHECKING:
    from .blocks import Block, Item


_TIMES_MAX = 10_000_000
"""Maximum number of invocations of one trial, because all values are kept until it ends."""


class Trial:
    """Result of a block's trial: an array of values for each output, `conditions` as (invocation, name, value or None), and `fault` or
    None."""

    def __init__(self, block: str, result: Mapping[str, Any]) -> None:
        outputs = result.get("outputs", result)
        self.block = block
        self.conditions = [tuple(c) for c in result.get("conditions", [])]
        self.fault: Any = result.get("fault")
        self.outputs = {name: np.array(values) for name, values in outputs.items() if name not in ("conditions", "fault")}

    def __getattr__(self, name: str) -> Any:
        outputs = self.__dict__.get("outputs", {})
        if name in outputs:
            return outputs[name]
        raise AttributeError(f"block '{self.__dict__.get('block')}' has no output '{name}'; {did_you_mean(name, outputs)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.outputs]

    def __repr__(self) -> str:
        outputs = ", ".join(f"{name}={values!r}" for name, values in self.outputs.items())
        return f"Trial({self.block}: {outputs}, conditions={self.conditions}, fault={self.fault!r})"


def _depth(item: Item) -> int:
    """Returns the number of dimensions of one value: `double[6]` has one."""
    return item.type.count("[")


def _shape(value: Any) -> tuple[int, ...]:
    """Returns the shape of a value. A struct has no shape, since its members differ; for a list of structs, the length is the number of
    invocations."""
    try:
        return np.shape(value)
    except ValueError:
        return (len(value),) if isinstance(value, list) else ()


def _series(item: Item, value: Any) -> tuple[Any, int]:
    """Returns the value of an input as JSON, and the number of invocations that it covers: 0 for a constant."""
    shape = _shape(value)
    if len(shape) > _depth(item):
        return plain(value, f"input '{item.name}'"), shape[0]
    return plain(value, f"input '{item.name}'"), 0


def run(block: Block, steps: int | None, every: Quantity, given: Mapping[str, Any]) -> Trial:
    """Runs a trial as described in `Block.run`."""
    values: dict[str, Any] = {}
    inputs: dict[str, Any] = {}
    lengths: dict[str, int] = {}
    for name, value in given.items():
        item = block.items.get(name)
        if item is None:
            refuse(CallError, f"block '{block.name}' has no item '{name}'", did_you_mean(name, block.items))
        if item.kind == "input":
            series, length = _series(item, value)
            inputs[name] = series
            if length:
                lengths[name] = length
        else:
            values[name] = plain(value, f"'{name}'")
    times = min(lengths.values(), default=1) if steps is None else whole(steps, "the number of invocations of a trial", 0, _TIMES_MAX)
    short = next((name for name, length in lengths.items() if length != times), None)
    if short is not None:
        refuse(
            CallError,
            f"input '{short}' has {lengths[short]} values, but the trial has {times} invocations",
            "pass one value for each invocation, or one constant",
        )
    for name in inputs:
        if name not in lengths:
            # The last value of a series holds for all further invocations.
            inputs[name] = [inputs[name]]
    period_ns = duration_ns(every, "the interval of a trial")
    if period_ns < 0 or (times + 1) * period_ns >= 2**63:
        refuse(
            OutOfRange,
            f"a trial of {times} invocations at intervals of {every!r} must take from 0 s to 292 years in total",
            "pass another interval, for example every='1 ms'",
        )
    interpreted = not getattr(block, "native", True)
    with refusals:
        name = block.name.split(".", 1)[1]
        text = _native.trial(block.module, name, json.dumps(values), json.dumps(inputs), times, period_ns, interpreted)
    return Trial(block.name, json.loads(text))
