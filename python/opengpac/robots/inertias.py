# SPDX-License-Identifier: Apache-2.0
"""Inertias as six numbers, xx, yy, zz, xy, xz, yz, and as symmetric matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Six = tuple[float, float, float, float, float, float]


def matrix_of(six: Sequence[float] | np.ndarray) -> np.ndarray:
    """Returns the symmetric 3 x 3 matrix of six numbers.
    >>> matrix_of((1, 2, 3, 4, 5, 6)).tolist()
    [[1, 4, 5], [4, 2, 6], [5, 6, 3]]
    """
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def six_of(matrix: np.ndarray) -> Six:
    """Returns the six numbers of a symmetric 3 x 3 matrix."""
    xx, yy, zz, xy, xz, yz = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
    return xx, yy, zz, xy, xz, yz
