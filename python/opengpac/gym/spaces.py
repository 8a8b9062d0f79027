# SPDX-License-Identifier: Apache-2.0
"""Spaces derived from terms: the inputs and outputs of a network, computed bit for bit as in the block of a policy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from ..definition.demands import check_names
from ..errors import DefinitionError, TypeMismatch, UnitMismatch, refuse
from ..policies.terms import Numbers, Term
from .values import Ports

Terms = Term | Sequence[Term]


class Side:
    """Terms of one input or output of a network, over the ports of a task."""

    def __init__(self, given: Terms, ports: Ports, side: str) -> None:
        self.terms = [given] if isinstance(given, Term) else [*given]
        self.widths: list[int] = []
        columns: dict[str, list[np.ndarray]] = {key: [] for key in ("least", "most", "offset", "low", "high", "scale")}
        for term in self.terms:
            if not isinstance(term, Term):
                refuse(
                    DefinitionError,
                    f"{side} of the environment must consist of terms, not {term!r}",
                    "pass gpac.Term(port, …), or a list of them",
                )
            count = self._size(term, ports, side)
            self.widths.append(count * term.history)
            for key, numbers in _columns(term, count).items():
                columns[key].append(np.tile(numbers, term.history))
        self.least, self.most, self.offset, self.low, self.high, self.scale = (np.concatenate(columns[key]) for key in columns)
        if np.any(self.scale == 0):
            refuse(DefinitionError, f"{side} of the environment cannot have a scale of 0")

    def _size(self, term: Term, ports: Ports, side: str) -> int:
        if term.previous:
            return term.size or 0
        where = ports.where(term.port, side)
        count, declared = where.stop - where.start, term.elements()
        variables = ports.variables[term.port]
        if declared not in (0, count):
            refuse(TypeMismatch, f"{side} '{term.port}' has {declared} numbers, but port '{term.port}' of the task has {count}")
        unit = ports.units[term.port]
        if term.unit and unit and term.unit != unit:
            refuse(UnitMismatch, f"{side} '{term.port}' is in {term.unit}, but port '{term.port}' of the task is in {unit}")
        check_names(f"{side} '{term.port}'", term.names, f"port '{term.port}'", [variable.name for variable in variables])
        return count


def _columns(term: Term, count: int) -> dict[str, np.ndarray]:
    def of(given: Numbers) -> np.ndarray:
        numbers = np.asarray(given, dtype=float)
        if numbers.shape not in ((), (count,)) or np.isnan(numbers).any():
            refuse(DefinitionError, f"'{term.port}' needs one number, or one for each of its {count} elements, not {given!r}")
        return np.broadcast_to(numbers, (count,)).copy()

    ends = lambda pair: (of(-np.inf if pair is None else pair[0]), of(np.inf if pair is None else pair[1]))  # noqa: E731
    (least, most), (low, high) = ends(term.within), ends(term.clip)
    offset, scale = of(0.0 if term.offset is None else term.offset), of(1.0 if term.scale is None else term.scale)
    return {"least": least, "most": most, "offset": offset, "low": low, "high": high, "scale": scale}


class NetworkInput(Side):
    """An input: x = scale · clip(port - offset), with previous values if a term has a history."""

    def __init__(self, given: Terms, ports: Ports, actions: int) -> None:
        super().__init__([self._sized(term, actions) for term in ([given] if isinstance(given, Term) else given)], ports, "observation")
        self._where = [None if term.previous else ports.where(term.port, "observation") for term in self.terms]
        self._rows: list[np.ndarray] = []
        low, high = self._scaled(np.full(len(self.scale), -np.inf)), self._scaled(np.full(len(self.scale), np.inf))
        self.space = spaces.Box(np.minimum(low, high), np.maximum(low, high), dtype=np.float32)

    @staticmethod
    def _sized(term: Term, actions: int) -> Term:
        if not isinstance(term, Term) or not term.previous:
            return term
        if term.history != 1 or term.size not in (None, actions):
            text = f"the previous actions must have history 1 and {actions} numbers, not history {term.history} and {term.size or actions}"
            refuse(DefinitionError, text, "use a port of the task for a history of actions")
        return Term(previous=term.previous, size=actions)

    def _scaled(self, numbers: np.ndarray) -> np.ndarray:
        within = np.minimum(np.maximum(numbers, self.least), self.most)
        return (np.minimum(np.maximum(within - self.offset, self.low), self.high) * self.scale).astype(np.float32)

    def begin(self) -> None:
        """Begins an episode with an empty history."""
        self._rows = []

    def of(self, numbers: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Returns the network's input, computed from the ports' numbers and its previous action."""
        now = [action if place is None else numbers[place] for place in self._where]
        first = not self._rows
        for at, (term, values) in enumerate(zip(self.terms, now, strict=True)):
            if first:
                self._rows.append(np.tile(values, term.history))
            else:
                self._rows[at] = np.concatenate([self._rows[at][len(values) :], values])
        return self._scaled(np.concatenate(self._rows))


class NetworkOutput(Side):
    """An output: port = clip(scale · y + offset)."""

    def __init__(self, given: Terms, ports: Ports) -> None:
        super().__init__(given, ports, "action")
        for term in self.terms:
            if term.previous or term.history != 1:
                refuse(DefinitionError, f"action {term!r} cannot have a history", "name the port that receives it")
        stores = [store for term in self.terms for store in ports.stores(term.port)]
        ends_at = np.cumsum([count for _, count in stores]).tolist()
        self._places = [(name, slice(end - count, end)) for (name, count), end in zip(stores, ends_at, strict=True)]
        ends = (self.low - self.offset) / self.scale, (self.high - self.offset) / self.scale
        self.space = spaces.Box(np.minimum(*ends).astype(np.float32), np.maximum(*ends).astype(np.float32), dtype=np.float32)

    def stores(self, action: np.ndarray) -> list[tuple[str, list[float]]]:
        """Returns the values to store in each SVV for an action."""
        numbers = np.minimum(np.maximum(action.astype(float) * self.scale + self.offset, self.low), self.high).tolist()
        return [(name, numbers[place]) for name, place in self._places]


class Observations:
    """All inputs of a network: one array if there is a single input, otherwise arrays by name."""

    def __init__(self, given: Terms | Mapping[str, Terms], ports: Ports, actions: int) -> None:
        self._one = None if isinstance(given, Mapping) else NetworkInput(given, ports, actions)
        self._several = {name: NetworkInput(terms, ports, actions) for name, terms in given.items()} if isinstance(given, Mapping) else {}
        self.space: spaces.Space[Any] = (
            self._one.space if self._one else spaces.Dict({name: of.space for name, of in self._several.items()})
        )

    def begin(self) -> None:
        """Begins an episode."""
        for observed in [self._one] if self._one else self._several.values():
            observed.begin()

    def of(self, numbers: np.ndarray, action: np.ndarray) -> Any:
        """Returns the network's input."""
        if self._one:
            return self._one.of(numbers, action)
        return {name: observed.of(numbers, action) for name, observed in self._several.items()}
