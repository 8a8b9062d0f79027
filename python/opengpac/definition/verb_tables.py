# SPDX-License-Identifier: Apache-2.0
"""Human-readable description of a verb: its table of lists and conditions, its picture, and its text."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from html import escape
from inspect import Signature
from typing import TYPE_CHECKING, Any, cast

from ..errors import Terminated
from ..pictures import PictureOwner
from . import endings
from .conditions import Termination

if TYPE_CHECKING:
    from .verbs import Verb


class VerbTables(PictureOwner):
    """Tables and picture of a verb, from the mappings of its definition."""

    name: str
    doc: str
    signature: Signature
    command_lists: dict[str, list[Any]]
    conditions: dict[str, Termination]
    transitions: dict[tuple[str, str], str]
    initial: str | None
    _supported: list[str]

    @property
    def supports(self) -> tuple[str, ...]:
        """Device types that the verb keeps running; empty for a verb that acts on devices."""
        return tuple(self._supported)

    @property
    def parts(self) -> Mapping[str, Verb[..., Any]]:
        """Verbs of which a composed verb consists, by label; empty for other verbs."""
        return {}

    @property
    def simple(self) -> bool:
        """True if the verb has a single command list."""
        return len(self.command_lists) == 1

    def reported(self, key: str) -> str:
        """Returns the name that reports use for an entry of the tables of conditions and outputs: its `key`, without the part's label."""
        return key

    def termination(self, condition: str, command_list: str) -> Termination | None:
        """Returns the entry of the table that applies to `condition` in `command_list`, or None."""
        lines = (t for key, t in self.conditions.items() if self.reported(key) == condition)
        return next((t for t in lines if not t.during or command_list in t.during), None)

    def table(self) -> list[tuple[str, str, str]]:
        """Returns the command lists × conditions table as rows (command list, condition, effect)."""
        rows: list[tuple[str, str, str]] = []
        never = endings.never_made(self.transitions, self.initial or next(iter(self.command_lists), ""))
        for name in self.command_lists:
            held = [self.reported(key) for key, t in self.conditions.items() if not t.during or name in t.during]
            for condition in dict.fromkeys([*held, *(t for c, t in self.transitions if c == name)]):
                rows.append((name, condition, self._outcome(name, condition, never)))
        return rows

    def _outcome(self, name: str, condition: str, never: Collection[tuple[str, str]]) -> str:
        if (name, condition) in self.transitions and (name, condition) not in never:
            to = f"→ {self.transitions[name, condition]}"
            return f"{to} if it runs on a remaining processor" if condition == "processor_lost" else to
        termination = self.termination(condition, name)
        if termination is not None and termination.raises is None and termination.returns is not None:
            return f"ends, returns {', '.join(map(self.reported, termination.returns)) or 'nothing'}"
        if condition == "completed" and (termination is None or termination.raises is None):
            return "ends"
        kind = (termination.raises if termination else None) or Terminated
        return f"ends, raises {kind.__name__}"

    def svg(self) -> str:
        """Returns a picture as SVG: command lists as states, transitions with their conditions, and the ends. A notebook shows it
        automatically."""
        from ..pictures.states import verb_svg

        return verb_svg(cast("Verb[..., Any]", self))

    def __repr__(self) -> str:
        kind = "simple verb" if self.simple else "composed verb" if self.parts else "verb"
        lines = [f"{kind} {self.name}{self.signature}: {(self.doc or '').strip().splitlines()[0] if self.doc else ''}".rstrip(": ")]
        lines += [f"  supports {', '.join(self.supports)}"] if self.supports else []
        lines += [f"  of {', '.join(_part_text(label, verb) for label, verb in self.parts.items())}"] if self.parts else []
        rows = self.table()
        wide = max([12, *(len(c) for c, _, _ in rows)])
        lines += [f"  {c:<{wide}} {t:<20} {what}" for c, t, what in rows]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        cells = (map(escape, row) for row in self.table())
        rows = "".join(f"<tr><td>{c}</td><td>{t}</td><td>{what}</td></tr>" for c, t, what in cells)
        head = f"<p><b>{escape(self.name)}</b>{escape(str(self.signature))}<br>{escape(self.doc)}</p>"
        return f"{head}{self.svg()}<table><tr><th>list</th><th>condition</th><th></th></tr>{rows}</table>"


def _part_text(label: str, verb: Verb[..., Any]) -> str:
    return label if label == verb.name else f"{label} ({verb.name})"
