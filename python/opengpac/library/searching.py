# SPDX-License-Identifier: Apache-2.0
"""Searches for components by words, best match first."""

from __future__ import annotations

import re
from collections.abc import Iterable

from .components import Component, Found


def ranked(components: Iterable[Component], words: Iterable[str]) -> Found:
    """Returns the components that contain all the words, ignoring case; "low-pass", "low pass" and "lowpass" are equivalent.

    A match in the name counts most, then the first line, then names of ports and parameters, and any other match least.
    """
    wanted = [_squeezed(word) for word in words if _squeezed(word)]
    scored = [(_score(component, wanted), component) for component in components]
    return Found(component for score, component in sorted((s for s in scored if s[0] > 0), key=lambda s: (-s[0], s[1].name)))


def _score(component: Component, wanted: list[str]) -> int:
    if not wanted:
        return 1
    texts = [
        (100, " ".join(component.names)),
        (30, component.title),
        (20, f"{component.category} {component.kind} {component.origin}"),
        (10, " ".join(component.items)),
        (3, " ".join([component.doc, *component.items.values()])),
    ]
    # A word that equals the name counts more than one that begins it.
    counts = [
        max(weight * (2 if weight == 100 and word in map(_squeezed, component.names) else 1) * _has(text, word) for weight, text in texts)
        for word in wanted
    ]
    return sum(counts) if all(counts) else 0


def _has(text: str, word: str) -> int:
    """Returns 2 if the text contains the word, 1 if one of its words begins with it, otherwise 0. A hyphenated word also counts as one
    word."""
    compounds = re.findall(r"[a-z0-9]+(?:[-_][a-z0-9]+)*", text.lower())
    tokens = [token for compound in compounds for token in (*re.split("[-_]", compound), _squeezed(compound))]
    return 2 if word in tokens else int(any(token.startswith(word) for token in tokens))


def _squeezed(word: str) -> str:
    return re.sub(r"[^a-z0-9]", "", word.lower())
