# SPDX-License-Identifier: Apache-2.0
"""Suspension of a verb: the verb idles, holds, switches its channels to safe values, or comes to rest first. Also defines the verb's
action when it is cut off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import DefinitionError, refuse
from ..refusals.argument_types import taking
from .blocks import Names, names_of


@dataclass(frozen=True)
class Holding:
    """Procedure that brings a verb to rest before suspension. Created by `gpac.holding`, with the same `set` and `until`."""

    set: tuple[str, ...]
    until: tuple[str, ...]

    def json(self) -> dict[str, Any]:
        """Returns the procedure in the model's format."""
        return {"holding": [{"set": of, "until": until} for of, until in zip(self.set, self.until, strict=True)]}


@taking
def holding(set: Names, until: Names) -> Holding:
    """Suspends by setting `set`, a bool input or parameter, and waiting for the condition `until`; `resume` clears it.

    For several blocks that move at different times or in parallel, pass a list of inputs, and a list of their conditions in the same
    order. The verb is suspended when the conditions of all active blocks have occurred: immediately if none is active, and after the
    verb's `ending_limit` at the latest.
    """
    inputs, conditions = tuple(names_of(set)), tuple(names_of(until))
    if not inputs or len(inputs) != len(conditions):
        refuse(
            DefinitionError,
            f"gpac.holding() needs as many conditions as inputs, but has {len(inputs)} inputs and {len(conditions)} conditions",
            "pass one of each, for example 'generator.holding' and 'generator.held', or lists of the same length",
        )
    return Holding(inputs, conditions)


def suspend_json(given: str | Holding, verb: str) -> Any:
    """Returns the value of `suspend=` in the model's format."""
    if isinstance(given, Holding):
        return given.json()
    if not isinstance(given, str) or given not in ("idle", "hold", "hold_last", "safe"):
        refuse(
            DefinitionError,
            f"suspend= of verb '{verb}' must be a policy, not {given!r}",
            "write 'idle', 'hold', 'hold_last', 'safe' or gpac.holding('label.input', 'label.condition')",
        )
    return given


def cut_off_json(given: str | None, verb: str) -> str | None:
    """Returns the value of `if_cut_off=` in the model's format."""
    if not isinstance(given, str | None) or given not in (None, "continue", "halt", "safe"):
        refuse(DefinitionError, f"if_cut_off= of verb '{verb}' must be a policy, not {given!r}", "write 'continue', 'halt' or 'safe'")
    return given
