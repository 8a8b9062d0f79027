# SPDX-License-Identifier: Apache-2.0
"""Quantities: plain numbers in SI units, or text with a unit, `"20 ms"`. Text is passed unchanged to the core, which parses units."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from typing import Any, TypeAlias

from .. import _native
from ..errors import OutOfRange, ValueRefused, refusals, refuse
from .arrays import np
from .numbers import number

Quantity: TypeAlias = float | int | str
"""A number in SI units or text such as `"20 ms"`, `"90 deg"`, `"0.5 rad/s"`."""


def is_duration(text: str) -> bool:
    """Returns whether the text is a duration, `"20 ms"`.
    >>> is_duration("20 ms"), is_duration("near.done")
    (True, False)
    """
    try:
        _native.number_in(text, "s")
    except (_native.Refused, UnicodeEncodeError):
        return False
    return not text.strip()[-1:].isdigit()


def duration_ns(duration: Quantity, what: str = "the duration") -> int:
    """Converts a duration to whole nanoseconds: a number of seconds, `"20 ms"`, or the period of a rate, `"1 kHz"`.
    >>> duration_ns("20 ms"), duration_ns(0.5), duration_ns("1 kHz")
    (20000000, 500000000, 1000000)
    """
    if isinstance(duration, str):
        with refusals:
            return _native.duration_ns(duration, what)
    duration = number(duration)
    if isinstance(duration, bool) or not isinstance(duration, int | float):
        refuse(ValueRefused, f"{what} must be a time, not {duration!r}", "write '20 ms', for example, or a number of seconds")
    ns = float(duration) * 1e9
    if math.isnan(ns):
        refuse(ValueRefused, f"{what} must be a time, not {duration!r}", "write '20 ms', for example, or a number of seconds")
    if not abs(ns) < 2**63:
        refuse(OutOfRange, f"{what} {duration!r} is out of range", "give a time of less than 292 years")
    return round(ns)


def span_ns(duration: Quantity, what: str) -> int:
    """Converts a duration to whole nanoseconds, like `duration_ns`, but refuses negative durations."""
    ns = duration_ns(duration, what)
    if ns < 0:
        said = duration if isinstance(duration, str) else f"{number(duration):g} s"
        refuse(OutOfRange, f"{what} cannot be {said}: its range is at least 0 s", "give a time that is not negative, for example '20 ms'")
    return ns


def optional_ns(duration: Quantity | None, what: str) -> int | None:
    """Converts a duration to whole nanoseconds, like `span_ns`; None is returned unchanged."""
    return None if duration is None else span_ns(duration, what)


_SIZES = {"B": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30, "TiB": 2**40}


def size_bytes(size: int | str, what: str = "the size") -> int:
    """Converts a size to whole bytes: a number of bytes, or text with a unit, `"500 MB"` or `"2 GiB"`.
    >>> size_bytes("500 MB"), size_bytes("2 GiB"), size_bytes(1_000_000)
    (500000000, 2147483648, 1000000)
    """
    remedy = "write '500 MB' or '2 GiB', for example, or a number of bytes"
    found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([A-Za-z]+)\s*", size) if isinstance(size, str) else None
    if found and found[2] in _SIZES:
        return round(float(found[1]) * _SIZES[found[2]])
    if found:
        remedy = f"write one of the units {', '.join(_SIZES)}"
    count = None if isinstance(size, str | bool) else number(size)
    if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count < 2**63:
        refuse(ValueRefused, f"{what} must be a size, not {size!r}", remedy)
    return count


def unknown_unit(unit: str) -> str | None:
    """Returns None if the unit of a port is valid (`"rad|m"` is either, a leading `=` refers to the unit of another item), otherwise the
    remedy.
    >>> unknown_unit("N.m"), unknown_unit("Nm")
    (None, "did you mean 'N.m'?")
    """
    if unit.startswith("="):
        return None
    for one in unit.split("|"):
        try:
            _native.number_in(f"1 {one}", "rad")
        except _native.Refused as refused:
            found = json.loads(str(refused))[0]
            if found["class"] == "ValueRefused":
                return found["remedy"]
        except UnicodeEncodeError:
            return "write a known unit"
    return None


def deg(angles: Sequence[float] | float | np.ndarray) -> Any:
    """Converts `angles` from degrees to rad: a number to a number, a sequence to an array.
    >>> deg(180.0)
    3.141592653589793
    >>> deg([0, 90]).round(4)
    array([0.    , 1.5708])
    """
    try:
        radians = np.deg2rad(np.asarray(angles, dtype=float))
    except (TypeError, ValueError):
        refuse(ValueRefused, f"the angles of gpac.deg() must be numbers, not {str(angles)[:80]!r}", "pass a number or a list of numbers")
    return float(radians) if radians.ndim == 0 else radians


def duration_text(ns: float, digits: int = 6) -> str:
    """Formats a duration in the largest unit in which it is at least one, rounded to `digits` digits.
    >>> duration_text(20_000_000), duration_text(1_234_567, digits=3)
    ('20 ms', '1.23 ms')
    """
    for unit, size in (("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if ns >= size:
            shown = f"{ns / size:.{digits}g}"
            return f"{ns / size:.0f} {unit}" if "e" in shown else f"{shown} {unit}"
    return f"{ns:.0f} ns"
