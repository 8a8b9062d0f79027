# SPDX-License-Identifier: Apache-2.0
"""Converts numbers of NumPy, pandas, PyTorch, JAX, `decimal` and `fractions` to plain numbers, so that they are accepted wherever a
number is.

None of those libraries is imported here, because the process of a driver needs none of them.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from numbers import Real
from typing import Any

from ..errors import CallError, refuse

_PLAIN = (bool, int, float, str, type(None))


def is_masked(value: Any) -> bool:
    """Returns whether a NumPy array has masked elements, which have no value although the array would return a number."""
    if type(value) in _PLAIN:
        return False
    # `mask` of a pandas table is a method.
    mask = getattr(value, "mask", None)
    return mask is not None and not callable(mask) and hasattr(value, "filled") and bool(mask.any())


def number(value: Any) -> Any:
    """Converts `value` to a Python number; anything that is not a single number is returned unchanged.

    Numbers are NumPy scalars of any width, arrays and tensors without dimensions, `Decimal`s and `Fraction`s.
    >>> import numpy as np
    >>> from fractions import Fraction
    >>> number(np.int64(3)), number(np.array(0.5)), number(np.longdouble(2)), number(Fraction(1, 4)), number([1])
    (3, 0.5, 2.0, 0.25, [1])
    """
    if type(value) in _PLAIN:
        return value
    # NumPy's scalars, and tensors of other libraries; masked elements contain no number.
    if is_masked(value):
        return value
    if getattr(value, "ndim", None) == 0 and callable(getattr(value, "item", None)):
        inner = value.item()
        if type(inner) in _PLAIN:
            return inner
        # `item` of NumPy's widest numbers returns such a number again.
        return float(inner) if isinstance(inner, Real) else value
    return float(value) if isinstance(value, Decimal | Real) and not isinstance(value, int | float) else value


def rows(value: Any) -> Any:
    """Converts an object with dimensions (an array, a tensor, a pandas table) to lists of numbers; returns other objects unchanged."""
    if getattr(value, "ndim", 0) > 0 and not is_masked(value):
        if callable(getattr(value, "tolist", None)):
            return value.tolist()
        if callable(getattr(value, "to_numpy", None)):
            return value.to_numpy().tolist()
    return value


_RANGE = re.compile(r"\[pose\]|[\[(][^,\[\]()]+,[^,\[\]()]+[\])]")
"""Pattern of a range as text, `"(0, inf)"`; the model checks its bounds."""


def range_of(given: Any, what: str) -> str | list[float | str] | None:
    """Returns a range in the model's format: two bounds, which are numbers or names of parameters, or a text, `"(0, inf)"`; None if no
    range is set."""
    if given is None or (isinstance(given, str) and _RANGE.fullmatch(given)):
        return given
    listed = rows(given)
    ends = [number(end) for end in listed] if isinstance(listed, list | tuple) else []
    if len(ends) == 2 and all(isinstance(end, str) or (is_number(end) and math.isfinite(end)) for end in ends):
        return [end if isinstance(end, str) else float(end) for end in ends]
    remedy = 'pass finite numbers, within=(0, 1), or a string, within="[0, inf)"'
    refuse(CallError, f"{what} must have two ends, not {repr(given)[:80]}", remedy)


def is_number(value: Any) -> bool:
    """Returns whether the value is a plain number, excluding Booleans."""
    return isinstance(value, int | float) and not isinstance(value, bool)
