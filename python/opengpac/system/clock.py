# SPDX-License-Identifier: Apache-2.0
"""Time of a system: its clock, and how a program advances it under the virtual clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..errors import CallError, refusals, refuse
from ..refusals.argument_types import all_taking
from ..values.quantities import Quantity, span_ns

if TYPE_CHECKING:
    from .realtime import RealTimeSystem


@all_taking
class SystemTime:
    """Clock of a `System`."""

    _alive: Callable[[], RealTimeSystem]

    @property
    def now(self) -> float:
        """Current time of the system's clock, in s."""
        with refusals:
            return self._alive().now() * 1e-9

    def advance(self, duration: Quantity | None = None, *, until: Callable[[], Any] | None = None, within: Quantity = "60 s") -> None:
        """Runs the firings in (now, now + `duration`] under the virtual clock, or until a predicate holds, `until=joint.sensed > 1.0`.

        With `until`, raises `TimeoutError` if it does not hold `within` that time.
        """
        native = self._alive()
        if (duration is None) == (until is None):
            refuse(CallError, "advance() needs a duration or until=", "write advance('2 s') or advance(until=svv > 1.0)")
        if until is None:
            ns = span_ns(duration or 0, "the duration to advance")
            with refusals:
                native.advance(ns)
            return
        limit_ns = span_ns(within, "within")
        with refusals:
            deadline = native.now() + limit_ns
        while not until():
            with refusals:
                moved = native.step()
                is_late = native.now() > deadline
            if not moved or is_late:
                why = "no further event is pending" if not moved else f"the time limit of {within} has elapsed"
                raise TimeoutError(f"{until!r} did not become true: {why}")
