# SPDX-License-Identifier: Apache-2.0
"""Numbers that come from elsewhere: NumPy, pandas, PyTorch, JAX, `decimal`, `fractions`. Each is a number wherever one is taken."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np

_PLAIN = (bool, int, float, str, type(None))


def number(value: Any) -> Any:
    """The number of Python that `value` is; anything that is no single number comes back as it is.

    A number is one of NumPy of any width, an array or a tensor without dimensions, a `Decimal` or a `Fraction`.

    >>> number(np.int64(3)), number(np.array(0.5)), number(np.longdouble(2)), number(Fraction(1, 4)), number([1])
    (3, 0.5, 2.0, 0.25, [1])
    """
    if type(value) in _PLAIN:
        return value
    if isinstance(value, np.floating | Decimal | Fraction):
        return float(value)
    # Of NumPy's scalars, and of tensors of other libraries.
    if getattr(value, "ndim", None) == 0 and callable(getattr(value, "item", None)):
        inner = value.item()
        # An item of the widest numbers of NumPy is such a number again.
        return float(inner) if isinstance(inner, np.floating) else inner if type(inner) in _PLAIN else value
    return value


def rows(value: Any) -> Any:
    """What has dimensions as lists of numbers: an array, a tensor, a table of pandas; anything else as it is."""
    if getattr(value, "ndim", 0) > 0:
        if callable(getattr(value, "tolist", None)):
            return value.tolist()
        if callable(getattr(value, "to_numpy", None)):
            return value.to_numpy().tolist()
    return value
