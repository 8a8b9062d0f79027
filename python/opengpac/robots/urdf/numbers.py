# SPDX-License-Identifier: Apache-2.0
"""Checks that the numbers of a URDF file's links and joints conform to the specification, and are finite and plausible."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

from ..plausible import ANGLE, HUGE, INERTIA, LENGTH, MASS, RATIO, Bounds, check_bounds
from .source import Source

MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_NUMBERS: Mapping[tuple[str, str], tuple[int, Bounds]] = {
    ("origin", "xyz"): (3, LENGTH),
    ("origin", "rpy"): (3, ANGLE),
    ("axis", "xyz"): (3, RATIO),
    # Invalid negative values are corrected later: of a mass, a size, a damping, a friction.
    ("mass", "value"): (1, Bounds(-HUGE, MASS.high, "kg")),
    **{("inertia", moment): (1, INERTIA) for moment in MOMENTS},
    ("box", "size"): (3, LENGTH),
    **{(shape, size): (1, LENGTH) for shape in ("cylinder", "capsule") for size in ("radius", "length")},
    ("sphere", "radius"): (1, LENGTH),
    ("mesh", "scale"): (3, RATIO),
    # Infinite limits are corrected later too.
    **{("limit", word): (1, Bounds(-float("inf"), float("inf"))) for word in ("lower", "upper", "velocity", "effort")},
    ("dynamics", "damping"): (1, Bounds()),
    ("dynamics", "friction"): (1, Bounds()),
    ("mimic", "multiplier"): (1, RATIO),
    ("mimic", "offset"): (1, ANGLE),
}
"""Required number of values and their bounds, by element and attribute."""


def clean(source: Source) -> None:
    """Corrects numbers that are separated by commas, and removes surplus numbers; refuses malformed numbers, and those out of bounds."""
    for top in [*source.root.findall("link"), *source.root.findall("joint")]:
        for element in top.iter():
            for attribute in [word for word in element.attrib if (element.tag, word) in _NUMBERS]:
                count, bounds = _NUMBERS[element.tag, attribute]
                _tidy(source, element, attribute, count)
                is_finite = bounds.high < float("inf")
                check_bounds(source, element, attribute, source.numbers(element, attribute, count, "", is_finite), bounds)


def _tidy(source: Source, element: ElementTree.Element, attribute: str, count: int) -> None:
    """Replaces commas with spaces, drops surplus numbers, and expands a single scale factor to three."""
    text = element.get(attribute, "")
    words = text.replace(",", " ").split()
    wrong = "separates its numbers by commas" if "," in text else ""
    if len(words) > count:
        taken = "is" if count == 1 else f"{count} are"
        wrong, words = f"has {len(words)} numbers; the first {taken} used", words[:count]
    if attribute == "scale" and len(words) == 1:
        wrong, words = "has one number, which is used for all directions", words * 3
    # A comma in a single number may be a decimal comma.
    if wrong and (count > 1 or "," not in text):
        source.note(f'{attribute}="{text[:60]}" of {source.called(element)} {wrong}', element)
        element.set(attribute, " ".join(words))
