# SPDX-License-Identifier: Apache-2.0
"""Third level, sequence: the order of the verbs. Written by the product's engineer: it names verbs only."""

from __future__ import annotations

from typing import Any

import opengpac as gpac


def press(approach: gpac.Verb[..., Any], insert: gpac.Verb[..., Any]) -> gpac.ComposedVerb:
    """Returns a verb that moves fast to the part, then slowly into it, in one real-time program."""
    return gpac.compose(
        "press",
        {"approach": approach, "insert": insert},
        transitions={("approach", "there"): "insert"},
        rename={"approach.to": "contact", "insert.to": "depth"},
        doc="Moves fast to the part, then presses slowly to the depth.",
    )
