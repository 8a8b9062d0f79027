# SPDX-License-Identifier: Apache-2.0
"""Pads matrices for blocks whose rows have a fixed length."""

from __future__ import annotations

from typing import Any

from ..errors import ValueRefused, refuse
from ..values.arrays import np


def padded(values: Any, length: int = 8) -> np.ndarray:
    """Returns a vector or the rows of a matrix padded with zeros to `length` numbers, for `state_space` and `lookup_surface`.
    >>> padded([[0.9, 0.1], [0.0, 0.8]])[1]
    array([0. , 0.8, 0. , 0. , 0. , 0. , 0. , 0. ])
    """
    given = np.asarray(values, dtype=float)
    if given.ndim not in (1, 2) or given.shape[-1] > length:
        refuse(ValueRefused, f"{values!r} cannot be padded", f"pass a vector, or a matrix whose rows have at most {length} numbers")
    return np.pad(given, [(0, 0)] * (given.ndim - 1) + [(0, length - given.shape[-1])])
