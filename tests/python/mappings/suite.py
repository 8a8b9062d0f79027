# SPDX-License-Identifier: Apache-2.0
"""On which mappings a conformance test runs."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from mappings.mapping import MAPPINGS

VIRTUAL_ONLY: dict[str, str] = {}
"""Tests that advance no time themselves and yet need the virtual clock, and why."""


def mappings_of(test: Callable[..., Any]) -> list[str]:
    """The names of the mappings that a conformance test runs on."""
    advances = ".advance(" in inspect.getsource(test)
    return [name for name, mapping in MAPPINGS.items() if mapping.virtual or not (advances or test.__name__ in VIRTUAL_ONLY)]
