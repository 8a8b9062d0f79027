# SPDX-License-Identifier: Apache-2.0
"""Things made twice under one name, as by a cell of a notebook that is run again: the same thing if it is asked for equally."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InUse, refuse

VOWELS = "aeiouS"
"""How the names of kinds begin that are spoken with a vowel: an arm, an SVV."""


class MadeThings:
    """Things made in a system, each under its kind and name, with what it was asked to be."""

    def __init__(self) -> None:
        self._things: dict[tuple[str, str], tuple[dict[str, Any], Any]] = {}

    def keep(self, kind: str, name: str, asked: Mapping[str, Any], thing: Any) -> None:
        """Keeps a thing that was made; what had its name before is forgotten."""
        self._things[kind, name] = dict(asked), thing

    def forget(self, kind: str, name: str) -> None:
        """Forgets a thing that is gone."""
        self._things.pop((kind, name), None)

    def thing(self, kind: str, name: str) -> Any:
        """The thing of that kind and name; None where none was made."""
        return self._things.get((kind, name), (None, None))[1]

    def equal(self, kind: str, name: str, asked: Mapping[str, Any]) -> bool:
        """Returns whether a thing was made that was asked for equally. Refused with `InUse` where it is another, naming what differs."""
        known = self._things.get((kind, name))
        if known is None:
            return False
        if said := differences(known[0], asked):
            article = "an" if kind[0] in VOWELS else "a"
            refuse(InUse, f"there is {article} {kind} '{name}' already: {said}", "make it as it is, or give it another name")
        return True


def differences(was: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """Returns the differences between two askings, with both values; empty if there are none."""
    told = [f"its {word.replace('_', ' ')} is {was.get(word)!r}, not {value!r}" for word, value in asked.items() if was.get(word) != value]
    return ", ".join(told)
