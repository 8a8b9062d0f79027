# SPDX-License-Identifier: Apache-2.0
"""Imports NumPy on first use, because a program with only plain numbers does not need it, and importing it takes half of the start-up
time."""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any, TypeGuard

__all__ = ["is_array", "is_record", "np"]

if TYPE_CHECKING:
    import numpy as np
else:

    class _NumPy:
        """Stand-in for the NumPy module."""

        def __getattr__(self, name: str) -> Any:
            value = getattr(importlib.import_module("numpy"), name)
            setattr(self, name, value)
            return value

    np = _NumPy()


def is_array(value: Any) -> TypeGuard[np.ndarray]:
    """Returns whether the value is a NumPy array; False while NumPy has not been imported."""
    return "numpy" in sys.modules and isinstance(value, np.ndarray)


def is_record(value: Any) -> TypeGuard[np.void]:
    """Returns whether the value is a record of a structured NumPy array."""
    return "numpy" in sys.modules and isinstance(value, np.void) and bool(value.dtype.names)
