# SPDX-License-Identifier: Apache-2.0
"""Termination conditions: the block or system conditions that they stand for, their outputs (ν), and their exceptions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import DefinitionError, Terminated, refuse
from ..refusals.argument_types import taking, whole
from ..refusals.source_location import Place, here
from .blocks import Names, names_of


@dataclass(frozen=True)
class Termination:
    """One entry of a verb's table of conditions. Created by `on`, with the same parameters. `place` is the source line in the program."""

    on: tuple[str, ...]
    returns: tuple[str, ...] | None
    raises: type[Terminated] | None
    during: tuple[str, ...]
    priority: int
    place: Place
    alarm: str | None = None

    def json(self) -> dict[str, Any]:
        """Returns the termination condition in the model's format."""
        return {
            "on": list(self.on), "returns": None if self.returns is None else list(self.returns), "raises": self.raises is not None,
            "during": list(self.during), "priority": self.priority, "alarm": self.alarm, "place": self.place.json(),
        }  # fmt: skip


@taking
def on(
    conditions: Names | None = None,
    *,
    returns: Sequence[str] | None = None,
    raises: type[Terminated] | bool | None = None,
    during: Names | None = None,
    priority: int = 0,
    alarm: str | None = None,
) -> Termination:
    """Creates a termination condition: `on("near.done", returns=["position"])`, `on("force.above", raises=Collision)`.

    Without block conditions, it stands for the system condition with the same name (`time_limit`, `halted` …). With `returns` and no
    `raises` the end is normal. `during` limits it to one or more command lists. If two conditions occur in one firing, the one with
    the larger `priority` takes effect. Each time the condition takes effect, it raises the alarm with the code `alarm`, which must be
    defined: `cell.alarms.define("E101", …)`.
    """
    if isinstance(raises, bool) or raises is None:
        raises = Terminated if raises else None
    elif not (isinstance(raises, type) and issubclass(raises, Terminated)):
        refuse(
            DefinitionError,
            f"raises= must be a class derived from gpac.Terminated, not {raises!r}",
            "define one: class Collision(gpac.Terminated)",
        )
    if alarm is not None and (not isinstance(alarm, str) or not alarm):
        refuse(DefinitionError, f"alarm= must be the code of an alarm, not {alarm!r}", "write alarm='E101', for example")
    return Termination(
        on=tuple(names_of(conditions)) if conditions is not None else (),
        returns=None if returns is None else tuple(names_of(returns)),
        raises=raises or None,
        during=tuple(names_of(during)) if during is not None else (),
        priority=whole(priority, "the priority of a condition", -(2**31), 2**31 - 1),
        place=here(),
        alarm=alarm,
    )


def termination_of(given: Any, name: str) -> Termination:
    """Returns the termination for a value of `conditions=`: `on(...)`, or just a block condition."""
    if isinstance(given, Termination):
        return given
    if isinstance(given, str | list | tuple):
        return on(given)
    refuse(DefinitionError, f"condition '{name}' must be created with on(...), not {given!r}", "write on('block.condition', returns=[…])")
