# SPDX-License-Identifier: Apache-2.0
"""How a verb is suspended: it holds, its channels go safe, or it comes to rest first; and what it does when it is cut off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .blocks import Names, names_of
from .errors import DefinitionError, refuse
from .given import taking


@dataclass(frozen=True)
class Holding:
    """A way to come to rest before a verb is suspended; made by `gpac.holding`."""

    set: str
    until: str

    def json(self) -> dict[str, Any]:
        """The form that the model takes."""
        return {"holding": [{"set": self.set, "until": self.until}]}


@taking
def holding(set: Names, until: Names) -> Holding:
    """Suspends by setting `set`, a bool input or parameter, and waiting for the condition `until`; `resume` clears it.

    Where the block of `until` is not active the verb is suspended at once, and after the verb's `ending_limit` in any case.
    """
    return Holding(_one(set, "what is set"), _one(until, "the condition"))


def _one(given: Names, what: str) -> str:
    names = list(names_of(given))
    if len(names) != 1:
        refuse(DefinitionError, f"gpac.holding is given {len(names)} names for {what}", "give one, for example 'generator.holding'")
    return names[0]


def suspend_json(given: str | Holding, verb: str) -> Any:
    """A value of `suspend=` in the form that the model takes."""
    if isinstance(given, Holding):
        return given.json()
    if not isinstance(given, str) or given not in ("hold", "safe"):
        refuse(
            DefinitionError,
            f"verb '{verb}' has suspend={given!r}",
            "write 'hold', 'safe' or gpac.holding('label.input', 'label.condition')",
        )
    return given


def cut_off_json(given: str | None, verb: str) -> str | None:
    """A value of `if_cut_off=` in the form that the model takes."""
    if not isinstance(given, str | None) or given not in (None, "continue", "halt", "safe"):
        refuse(DefinitionError, f"verb '{verb}' has if_cut_off={given!r}", "write 'continue', 'halt' or 'safe'")
    return given
