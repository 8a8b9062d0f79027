# SPDX-License-Identifier: Apache-2.0
"""Function block commands: the elements of command lists. Each takes labels of the verb's blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import DefinitionError, refuse
from ..refusals.argument_types import taking
from ..values.numbers import number
from ..values.quantities import Quantity, is_duration, optional_ns, span_ns
from .blocks import Name, names_of


@dataclass(frozen=True)
class Interval:
    """An execution interval. Created by `gpac.interval`, with the same `every` and `tunable`."""

    every: Quantity
    tunable: bool = False


@taking
def interval(every: Quantity, *, tunable: bool = False) -> Interval:
    """Creates an execution interval, `every="20 ms"`; if `tunable`, `vi.set(every={...})` may change it while the verb runs.
    >>> activate("generator", every=interval("20 ms", tunable=True))["tunable"]
    True
    """
    return Interval(every, tunable)


Command: TypeAlias = dict[str, Any]
"""A function block command in the model's format."""


@taking
def install(*blocks: Name) -> Command:
    """Resets the state of these blocks. Every block that a list names is installed implicitly."""
    return {"command": "install", "blocks": [str(block) for block in blocks]}


@taking
def execute(block: Name) -> Command:
    """Invokes a block or graph once, immediately; the next command starts after it."""
    return {"command": "execute", "block": str(block)}


@taking
def activate(block: Name, every: Quantity | Interval | None = None, *, budget: Quantity | None = None) -> Command:
    """Starts repetitive execution of `block`. With `every="20 ms"`, the block runs at that interval. Otherwise, it runs when its
    synchronous inputs have new values, or when the trigger on which it is placed occurs. `every=gpac.interval("20 ms", tunable=True)`
    can be changed while the block runs. `budget` is the maximum time that one invocation may take before it counts as a fault.
    >>> activate("generator", every="20 ms")
    {'command': 'activate', 'block': 'generator', 'every_ns': 20000000, 'tunable': False, 'budget_ns': None}
    """
    given = every if isinstance(every, Interval) else Interval(every) if every is not None else None
    return {
        "command": "activate",
        "block": str(block),
        "every_ns": optional_ns(given.every if given else None, f"the interval of '{block}'"),
        "tunable": given is not None and given.tunable,
        "budget_ns": optional_ns(budget, f"the budget of '{block}'"),
    }


@taking
def deactivate(block: Name) -> Command:
    """Ends the repetitive execution of a block."""
    return {"command": "deactivate", "block": str(block)}


@taking
def wait(until: Quantity | Name | Sequence[Name] | None = None) -> Command:
    """Waits for a condition (or the first of several), for a time, or, without an argument, until no instance is active.
    >>> wait("near.done"), wait("0.5 s")
    ({'command': 'wait', 'conditions': ['near.done']}, {'command': 'wait', 'time_ns': 500000000})
    """
    if until is None:
        return {"command": "wait"}
    until = number(until)
    if isinstance(until, int | float) or (isinstance(until, str) and is_duration(until)):
        return {"command": "wait", "time_ns": span_ns(until, "the time of a wait")}
    return {"command": "wait", "conditions": names_of(until)}


def ready() -> Command:
    """Declares the device enabled when its verb reaches this command."""
    return {"command": "ready"}


def checked(command: Any, where: str) -> Command:
    """Checks that the value is a command, and returns it."""
    if isinstance(command, dict) and "command" in command:
        return command
    refuse(
        DefinitionError,
        f"{where} contains {command!r}, which is not a command",
        "write execute('block'), activate('block', every='1 ms') …",
    )
