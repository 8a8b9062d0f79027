# SPDX-License-Identifier: Apache-2.0
"""NumPy, loaded when something of it is used first: a program of plain numbers needs none of it, and loading it takes half of its start."""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any, TypeGuard

__all__ = ["is_array", "is_record", "np"]

if TYPE_CHECKING:
    import numpy as np
else:

    class _NumPy:
        """Stands for the module."""

        def __getattr__(self, name: str) -> Any:
            value = getattr(importlib.import_module("numpy"), name)
            setattr(self, name, value)
            return value

    np = _NumPy()


def is_array(value: Any) -> TypeGuard[np.ndarray]:
    """Returns whether it is an array of NumPy. Nothing is one where nobody has loaded NumPy."""
    return "numpy" in sys.modules and isinstance(value, np.ndarray)


def is_record(value: Any) -> TypeGuard[np.void]:
    """Returns whether it is a record of a structured array of NumPy."""
    return "numpy" in sys.modules and isinstance(value, np.void) and bool(value.dtype.names)
