# SPDX-License-Identifier: Apache-2.0
"""Quantities: plain numbers in SI units, or text with a unit, `"20 ms"`. Values go to the real-time system as they are written,
which knows the units of ports; only durations are read here."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from .errors import UnitMismatch, ValueRefused, refuse

Quantity: TypeAlias = float | int | str
"""A number in SI units or text such as `"20 ms"`, `"90 deg"`, `"0.5 rad/s"`."""

_SECONDS = {
    "ns": 1,
    "us": 1_000,
    "µs": 1_000,
    "μs": 1_000,
    "ms": 1_000_000,
    "s": 1_000_000_000,
    "min": 60_000_000_000,
    "h": 3_600_000_000_000,
}
_HERTZ = {"Hz": 1, "kHz": 1_000, "MHz": 1_000_000}
_PATTERN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\s\d]*)\s*")


def is_duration(text: str) -> bool:
    """Whether the text reads as a time, `"20 ms"`.

    >>> is_duration("20 ms"), is_duration("near.done")
    (True, False)
    """
    match = _PATTERN.fullmatch(text)
    return bool(match) and match[2] in _SECONDS


def duration_ns(duration: Quantity, what: str = "the duration") -> int:
    """Whole nanoseconds of a duration: a number of seconds, `"20 ms"`, or the period of a rate, `"1 kHz"`.

    >>> duration_ns("20 ms"), duration_ns(0.5), duration_ns("1 kHz")
    (20000000, 500000000, 1000000)
    """
    if isinstance(duration, str):
        match = _PATTERN.fullmatch(duration)
        if not match:
            refuse(ValueRefused, f"{what} '{duration}' is not a quantity", "write for example '20 ms'")
        number, unit = float(match[1]), match[2]
        if not unit:
            refuse(ValueRefused, f"{what} '{duration}' has no unit", "write for example '20 ms', or a number of seconds")
        if unit in _HERTZ and number > 0:
            ns = 1e9 / (number * _HERTZ[unit])
        elif unit in _SECONDS:
            ns = number * _SECONDS[unit]
        else:
            refuse(UnitMismatch, f"{what} '{duration}' is not a time", "write for example '20 ms'")
    elif isinstance(duration, bool) or not isinstance(duration, int | float | np.number):
        refuse(ValueRefused, f"{what} {duration!r} is not a time", "write for example '20 ms', or a number of seconds")
    else:
        ns = float(duration) * 1e9
    if not abs(ns) < 2**63:
        refuse(ValueRefused, f"{what} {duration!r} is out of range")
    return round(ns)


def optional_ns(duration: Quantity | None, what: str) -> int | None:
    """As `duration_ns`, and nothing for nothing."""
    return None if duration is None else duration_ns(duration, what)


def deg(angles: Sequence[float] | float | np.ndarray) -> Any:
    """Angles in degrees as rad: a number gives a number, a sequence an array.

    >>> deg(180.0)
    3.141592653589793
    >>> deg([0, 90]).round(4)
    array([0.    , 1.5708])
    """
    try:
        radians = np.deg2rad(np.asarray(angles, dtype=float))
    except (TypeError, ValueError):
        refuse(ValueRefused, f"gpac.deg() is given {str(angles)[:80]!r}", "give a number or a list of numbers")
    return float(radians) if radians.ndim == 0 else radians


def duration_text(ns: float, digits: int = 6) -> str:
    """A duration in the largest unit of which it is one or more, rounded to so many digits.

    >>> duration_text(20_000_000), duration_text(1_234_567, digits=3)
    ('20 ms', '1.23 ms')
    """
    for unit, size in (("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if ns >= size:
            shown = f"{ns / size:.{digits}g}"
            return f"{ns / size:.0f} {unit}" if "e" in shown else f"{shown} {unit}"
    return f"{ns:.0f} ns"
