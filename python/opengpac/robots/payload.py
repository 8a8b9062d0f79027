# SPDX-License-Identifier: Apache-2.0
"""Payload of an arm."""

from __future__ import annotations

from dataclasses import dataclass

from .. import library
from ..errors import CallError, refuse
from ..values.encoding import plain
from ..values.numbers import number


@dataclass(frozen=True)
class Payload:
    """Payload of an arm: its mass (kg, from 0) and its `centre` of mass in the flange's frame (m).

    Raises `OutOfRange` for an implausible mass or coordinate, `CallError` for a centre that is not three numbers.
    """

    mass: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

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
