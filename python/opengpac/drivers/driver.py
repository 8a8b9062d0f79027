# SPDX-License-Identifier: Apache-2.0
"""Description of a driver before it is opened: its kind and its options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Driver:
    """A driver to be opened: its kind and its options."""

    kind: str
    options: Mapping[str, Any] = field(default_factory=dict)


UNLIMITED = 1e6
"""Limit value that means "no limit" in the declaration of a part."""


def given(**options: Any) -> dict[str, Any]:
    """Returns the options that are not None."""
    return {name: value for name, value in options.items() if value is not None}
