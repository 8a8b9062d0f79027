# SPDX-License-Identifier: Apache-2.0
"""Objects created twice under one name, as when a notebook cell is run again: equal arguments return the same object."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InUse, refuse

VOWELS = "aeiouS"
"""Initial letters that take the article "an": an arm, an SVV."""


class MadeThings:
    """Objects created in a system, by kind and name, with their arguments."""

    def __init__(self) -> None:
        self._things: dict[tuple[str, str], tuple[dict[str, Any], Any]] = {}

    def keep(self, kind: str, name: str, asked: Mapping[str, Any], thing: Any) -> None:
        """Registers an object; replaces a previous one with the same name."""
        self._things[kind, name] = dict(asked), thing

    def forget(self, kind: str, name: str) -> None:
        """Removes an object that no longer exists."""
        self._things.pop((kind, name), None)

    def thing(self, kind: str, name: str) -> Any:
        """Returns the object with that kind and name, or None if none was created."""
        return self._things.get((kind, name), (None, None))[1]

    def equal(self, kind: str, name: str, asked: Mapping[str, Any]) -> bool:
        """Returns whether an object was created with equal arguments. Raises `InUse`, which names the difference, if they differ."""
        known = self._things.get((kind, name))
        if known is None:
            return False
        if said := differences(known[0], asked):
            article = "an" if kind[0] in VOWELS else "a"
            refuse(InUse, f"{article} {kind} '{name}' already exists: {said}", "create it with the same values, or choose another name")
        return True


def differences(was: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """Returns the differences between two sets of arguments, with both values; empty if they are equal."""
    told = [f"its {word.replace('_', ' ')} is {was.get(word)!r}, not {value!r}" for word, value in asked.items() if was.get(word) != value]
    return ", ".join(told)
