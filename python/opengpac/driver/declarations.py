# SPDX-License-Identifier: Apache-2.0
"""Functions that declare the members of a driver class: `Option`, `read`, `write`, `part`, `counter`, `service`."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, overload

from .. import _native
from ..errors import DefinitionError, refusals, refuse
from .members import NEEDED, Channel, Counter, OptionMember, Part, Service

if TYPE_CHECKING:
    from .base import Driver

F = TypeVar("F", bound=Callable[..., Any])

_UNLIMITED = 1e6
"""Limit value that means "no limit" in the declaration of a part, as in drivers in other languages."""


def Option(doc: str, default: Any = NEEDED, *, unit: str = "", within: str | Sequence[float] | None = None) -> Any:
    """Declares an option of a driver: `port: str = Option("the serial port")`, described by `doc`. Without a `default` it is required; a
    number may have a `unit`.

    `within` is the range of a number, `(0, 60)` or `"(0, inf)"`: values outside are refused before the device is opened. A time (`s`,
    `ns`) without a range must not be negative.
    """
    return OptionMember(doc, default, unit, within)


def read(type: str = "double", *, unit: str = "", doc: str = "") -> Any:
    """Declares a channel that is read from the machine: `exchange` sets it. `type` is a C numeric type, or an array such as
    `"double[3]"`."""
    return Channel(type, unit, doc, False, None, None)


def write(type: str = "double", *, unit: str = "", doc: str = "", safe: Any = None, slew: float | None = None) -> Any:
    """Declares a channel that is written to the machine: `exchange` reads the command from it. `safe` is its value while no verb
    commands it (0 by default); `slew` is the maximum rate of change of a `double`, in units per second."""
    return Channel(type, unit, doc, True, safe, slew)


def part(
    *,
    unit: str = "rad",
    command: str = "position",
    range: tuple[float | str, float | str] | None = None,
    speed_max: float | str | None = None,
    effort_max: float | str | None = None,
    home: float | str = 0.0,
    kp: float = 0.0,
    kd: float = 0.0,
    operating: bool = False,
) -> Any:
    """Declares a joint of the machine, `elbow = part(range=("-150 deg", "150 deg"), speed_max=2.0)`: `exchange` sets
    `self.elbow.position` and `self.elbow.velocity`, and reads `self.elbow.goal`, which is NaN if there is no goal.
    `gpac.robots.Joint(…, drive=device["elbow"])` drives it.

    `unit` is `rad` or `m`. `command="effort"` declares a joint whose control loop runs in the program, with gains `kp` and `kd` at 1
    kHz: `exchange` reads `effort`, and sets `bias`, the holding effort. With `operating=True`, `exchange` sets
    `self.elbow.operating`, and `enable` and verbs wait until it is true. An omitted limit means no limit; a number is in `unit`, and
    a text may use any unit.
    """
    if unit not in ("rad", "m") or command not in ("position", "effort"):
        refuse(
            DefinitionError,
            f"a part cannot have unit '{unit}' and command '{command}'",
            "use unit 'rad' or 'm' and command 'position' or 'effort'",
        )

    def number(value: float | str | None, of: str, without: float) -> float:
        if isinstance(value, str):
            with refusals:
                return _native.number_in(value, of)
        return without if value is None else float(value)

    force = "N.m" if unit == "rad" else "N"
    lower, upper = (number(None if range is None else range[end], unit, none) for end, none in ((0, -_UNLIMITED), (1, _UNLIMITED)))
    limits = {
        "range_min": lower, "range_max": upper, "home": number(home, unit, 0.0), "servo": {"kp": float(kp), "kd": float(kd)},
        "speed_max": number(speed_max, f"{unit}/s", _UNLIMITED), "effort_max": number(effort_max, force, _UNLIMITED),
    }  # fmt: skip
    if not (lower < upper and limits["speed_max"] > 0 and limits["effort_max"] > 0):
        refuse(DefinitionError, f"a part cannot have the limits {limits}", "specify an ascending range, and maxima above 0")
    return Part(unit, command, operating, limits)


def counter(doc: str, *, unit: str = "") -> Any:
    """Declares a counter of a driver, `damaged = counter("answers with a wrong checksum")`, which starts at 0 and which `exchange`
    increments. Programs read it in `device.counters`, `statistics` and `opengpac top`."""
    return Counter(doc, unit)


@overload
def service(method: F) -> F: ...
@overload
def service(*, moves: bool = False) -> Callable[[F], F]: ...
def service(method: F | None = None, *, moves: bool = False) -> F | Callable[[F], F]:
    """Declares a method as an acyclic service that programs can call: `device.services.calibrate(at="300 K")`. Argument types are
    checked, and the docstring is shown. An argument may be an `Option` with a unit and a description. The method runs between two
    exchanges, during which the readings age. `@service(moves=True)` declares that it moves the machine: it is refused while an
    emergency stop is latched."""

    def made_of(method: F) -> F:
        made = Service(method, moves)

        @functools.wraps(method)
        def call(self: Driver, *values: Any, **named: Any) -> Any:
            return method(self, **made.taken({**dict(zip(made.arguments, values, strict=False)), **named}))

        call.service = made  # type: ignore[attr-defined]
        return call  # type: ignore[return-value]

    return made_of if method is None else made_of(method)
