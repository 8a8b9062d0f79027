# SPDX-License-Identifier: Apache-2.0
"""Payload of an arm."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import library
from ..errors import CallError, refuse
from ..values.encoding import plain
from ..values.numbers import number
from .inertias import Six, matrix_of

NO_INERTIA = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Inertia of a point mass."""


@dataclass(frozen=True)
class Payload:
    """Payload of an arm: its mass (kg, from 0) and its `centre` of mass in the flange's frame (m).

    `inertia` is about the centre of mass in the axes of the flange, kg m², as xx, yy, zz, xy, xz, yz; only `arm.dynamics.carrying`
    uses it. Raises `OutOfRange` for an implausible mass or coordinate, `CallError` for a centre that is not three numbers and an
    inertia that is not that of a body.
    """

    mass: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] = NO_INERTIA

    def __post_init__(self) -> None:
        items, centre = library.payload_effort.items, plain(self.centre, "the centre of mass of a payload")
        items["mass"].check(self.mass, "the mass of a payload")
        if not isinstance(centre, list) or len(centre) != 3:
            refuse(
                CallError,
                f"the centre of mass of a payload must be three coordinates, not {self.centre!r}",
                "pass them in the flange's frame, in m",
            )
        for coordinate in centre:
            items["centre"].check(coordinate, "the centre of mass of a payload")
        # Use plain numbers: payloads of arrays could not be compared.
        object.__setattr__(self, "mass", number(self.mass))
        object.__setattr__(self, "centre", tuple(centre))
        object.__setattr__(self, "inertia", _inertia(self.inertia))


def _inertia(given: Any) -> Six:
    """Returns six plain numbers; refuses those that no body can have."""
    six = plain(given, "the inertia of a payload")
    if not isinstance(six, list) or len(six) != 6 or not all(isinstance(value, int | float) and math.isfinite(value) for value in six):
        refuse(CallError, f"the inertia of a payload must be six numbers, not {given!r}", "pass xx, yy, zz, xy, xz and yz in kg m²")
    xx, yy, zz, xy, xz, yz = (float(value) for value in six)
    moments = np.linalg.eigvalsh(matrix_of(six))
    tolerance = 1e-9 * max(moments[2], 1e-6)
    if moments[0] < -tolerance or moments[2] > moments[0] + moments[1] + tolerance:
        shown = ", ".join(f"{moment:.3g}" for moment in moments)
        refuse(
            CallError,
            f"no body has the inertia {given!r}: its principal moments would be {shown} kg m²",
            "pass moments that are not negative, none of which is above the sum of the other two",
        )
    return (xx, yy, zz, xy, xz, yz)
