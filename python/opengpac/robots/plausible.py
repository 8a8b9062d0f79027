# SPDX-License-Identifier: Apache-2.0
"""Bounds of the numbers in arm files. Infinite or implausible numbers are refused with their line before MuJoCo reads them.

MuJoCo treats `nan` as an omitted number, and accepts a mass of 1e30 kg.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree

if TYPE_CHECKING:
    from .urdf.source import Source

HUGE = 1e10
"""Limit above which MuJoCo itself considers the simulation to have diverged."""


@dataclass(frozen=True)
class Bounds:
    """Minimum and maximum of a number, and its unit."""

    low: float = -HUGE
    high: float = HUGE
    unit: str = ""

    def broken_by(self, values: list[float]) -> str:
        """Returns the bound that one of the values violates, or an empty text."""
        if max(values, default=self.high) > self.high:
            return f"above {self.high:,.0f} {self.unit}".rstrip()
        if min(values, default=self.low) < self.low:
            return f"below {self.low:,.6g} {self.unit}".rstrip()
        return ""


LENGTH = Bounds(-1e4, 1e4, "m")
ANGLE = Bounds(-1e4, 1e4, "rad")
MASS = Bounds(0.0, 1e6, "kg")
INERTIA = Bounds(-1e9, 1e9, "kg.m^2")
RATIO = Bounds(-1e6, 1e6)
_AT_LEAST_ZERO = Bounds(low=0.0)

_MJCF: Mapping[str, Bounds] = {
    "mass": MASS,
    **dict.fromkeys(("pos", "fromto", "size"), LENGTH),
    **dict.fromkeys(("diaginertia", "fullinertia"), INERTIA),
    **dict.fromkeys(("armature", "frictionloss", "density"), _AT_LEAST_ZERO),
    # Some files lock a joint by its damping.
    "damping": Bounds(0.0, 1e15),
    "timestep": Bounds(1e-6, 1.0, "s"),
    "gravity": Bounds(-1e4, 1e4, "m/s^2"),
    "gear": RATIO,
    "range": Bounds(-1e9, 1e9),
}
"""Bounds of the numbers in an MJCF file, by attribute; other numbers are at most `HUGE`."""
_WORDS = ("name", "class", "childclass", "user")
"""Attributes of an MJCF file that are ignored, or whose values are not numbers even if they look like numbers."""
_UNREAD = ("custom", "extension", "visual", "statistic")


def check_mjcf(source: Source) -> None:
    """Refuses an MJCF file that contains a number that is not finite or is out of bounds."""
    names = {element.get(word, "") for element in source.root.iter() for word in _WORDS}
    for element in _read(source.root):
        for attribute, text in element.attrib.items():
            if attribute in _WORDS or text in names or not (values := _numbers(text)):
                continue
            if any(abs(value) == float("inf") or value != value for value in values):
                source.refuse_number(element, attribute, "is not finite", "write a number there, or remove it")
            check_bounds(source, element, attribute, values, _MJCF.get(attribute, Bounds()))


def check_bounds(source: Source, element: ElementTree.Element, attribute: str, values: list[float], bounds: Bounds) -> None:
    """Refuses a file if a number in an attribute is out of bounds."""
    if passed := bounds.broken_by(values):
        source.refuse_number(element, attribute, f"is {passed}, which is not plausible", "check its unit, and correct the number")


def _numbers(text: str) -> list[float]:
    """Returns the numbers of an attribute; empty if one of its words is not a number."""
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []


def _read(root: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Yields the elements whose numbers MuJoCo reads."""
    yield root
    for child in root:
        if child.tag not in _UNREAD:
            yield from _read(child)
