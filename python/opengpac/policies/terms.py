# SPDX-License-Identifier: Apache-2.0
"""Meaning of a slice of a network's input or output: `gpac.Term("q", names=joints, unit="rad", offset=default_pose)`."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import DefinitionError, refuse
from ..values.arrays import np

Numbers: TypeAlias = "float | Sequence[float] | np.ndarray"
Terms: TypeAlias = "str | Term | Sequence[Term]"


@dataclass(frozen=True, kw_only=True)
class _Term:
    size: int | None = None
    unit: str = ""
    names: Sequence[str] = ()
    scale: Numbers | None = None
    offset: Numbers | None = None
    clip: tuple[Numbers, Numbers] | None = None
    within: tuple[Numbers, Numbers] | None = None
    history: int = 1
    observation: str = ""
    synchronous: bool = False
    doc: str = ""


@dataclass(frozen=True)
class Term(_Term):
    """Consecutive elements of a network's input or output that form one port of its block, and their meaning.

    An input is x = scale · clip(port - offset), an output is port = clip(scale · y + offset), in the order used by Isaac Lab and
    mjlab. `names` are the names of its elements, in order, such as joints; `size` is their number if no list implies it. `scale`,
    `offset` (a default pose) and the bounds of `clip` are one number or one for each element, in the port's `unit`; omitted ones are
    taken from the file if it contains them. `within` is the range of the training values: a value outside is `out_of_distribution`,
    and the network receives the nearest bound. The `history` most recent values are passed one after another, oldest first.
    `observation` is the trainer's name, by default the port's. `previous` replaces a `port`: that output of the network in the
    previous invocation. `doc` describes the port. A `synchronous` port makes the block due when its writer has a new value; otherwise
    it reads the latest one.
    """

    port: str = ""
    previous: str = ""

    def json(self) -> dict[str, Any]:
        """Returns the term in the backend's format."""
        size = self.elements()
        pair = lambda what, ends: None if ends is None else _range(what, ends, size, self.port)  # noqa: E731
        return {
            "port": self.port, "size": size, "unit": self.unit, "doc": self.doc, "observation": self.observation,
            "names": [str(name) for name in self.names], "scale": _list(self.scale, size, self.port),
            "offset": _list(self.offset, size, self.port), "clip": pair("clip", self.clip), "within": pair("within", self.within),
            "history": self.history, "previous": self.previous, "mode": "synchronous" if self.synchronous else "asynchronous",
        }  # fmt: skip

    def elements(self) -> int:
        """Returns the declared number of elements, or 0 if the port or the file determines it."""
        if bool(self.port) == bool(self.previous):
            refuse(
                DefinitionError,
                f"{self!r} must have either a port or a previous output, not {'both' if self.port else 'neither'}",
                "pass one of them",
            )
        if self.history < 1:
            refuse(DefinitionError, f"the history of '{self.port}' must be at least 1, not {self.history}", "pass the number of values")
        if self.size is not None:
            return self.size
        if self.names:
            return len(self.names)
        lists = [self.scale, self.offset, *(self.clip or ()), *(self.within or ())]
        return next((len(np.atleast_1d(x)) for x in lists if x is not None and np.ndim(x) == 1), 0)


_FAR = sys.float_info.max
"""Replacement for an infinite bound of a range, which JSON cannot represent."""


def _range(what: str, ends: Any, size: int, port: str) -> list[list[float]]:
    """Returns the lower and upper bounds of `clip` or `within`, which may be infinite."""
    try:
        least, most = ends
    except (TypeError, ValueError):
        refuse(DefinitionError, f"{what} of '{port}' must be a minimum and a maximum, not {ends!r}", f"write {what}=(-1, 1), for example")
    low, high = (_list(end, size, port, finite=False) or [] for end in (least, most))
    if len(low) != len(high):
        text = f"{what} of '{port}' has {len(low)} minima but {len(high)} maxima"
        refuse(DefinitionError, text, "pass the same number of both, or one of each")
    for i, (a, b) in enumerate(zip(low, high, strict=True)):
        if not a <= b or a == np.inf or b == -np.inf:
            at = f" at element {i}" if np.ndim(least) or np.ndim(most) else ""
            text = f"{what} of '{port}' is an empty range, {a:g} to {b:g}{at}"
            refuse(DefinitionError, text, f"write the minimum first, {what}=(-1, 1)")
    return [[float(np.clip(x, -_FAR, _FAR)) for x in side] for side in (low, high)]


def _list(given: Numbers | None, size: int, port: str, finite: bool = True) -> list[float] | None:
    if given is None:
        return None
    try:
        numbers = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    if np.isnan(numbers).any() or numbers.ndim != 1 or (finite and np.isinf(numbers).any()):
        refuse(DefinitionError, f"the numbers {given!r} of '{port}' are not a list of {'finite ' if finite else ''}numbers")
    if np.ndim(given) == 0 and size == 0:
        refuse(DefinitionError, f"the number of elements of '{port}' is not specified", "pass size= or names=")
    return [float(x) for x in (np.repeat(numbers, size) if np.ndim(given) == 0 else numbers)]


def terms_json(given: Mapping[str, Terms] | None, side: str) -> dict[str, list[dict[str, Any]]]:
    """Returns `inputs=` or `outputs=` as a mapping from names of the network to terms. A text is taken as the unit of a port of that
    name."""
    made: dict[str, list[dict[str, Any]]] = {}
    for name, terms in (given or {}).items():
        terms = Term(name, unit=terms) if isinstance(terms, str) else terms
        listed = [terms] if isinstance(terms, Term) else list(terms)
        for term in listed:
            if not isinstance(term, Term):
                refuse(
                    DefinitionError,
                    f"{side} '{name}' of the policy must consist of terms, not {term!r}",
                    "pass gpac.Term(port, …), or a list of them",
                )
        made[name] = [term.json() for term in listed]
    return made
