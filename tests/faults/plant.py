# SPDX-License-Identifier: Apache-2.0
"""The machine that a campaign drives: a plant in a process of its own, which outlives its program and reports when it obeyed a command."""

from __future__ import annotations

import contextlib
import json
import secrets
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

import opengpac as gpac
from opengpac import _native

LIMIT_S = 20.0
"""Time limit of every wait; a safety net, not a measure."""

LINGER = "1 s"
"""Time for which the plant continues without a commander; after it nothing of the plant is left."""


class Plant:
    """Drive with a speed proportional to the push; its safe state is rest."""

    def __init__(self, name: str | None = None) -> None:
        self.name = name or f"campaign-{secrets.token_hex(6)}"

    def driver(self) -> gpac.drivers.Driver:
        """Returns the driver of the plant, here or in another process that received its name."""
        return gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=self.name, linger=LINGER)

    def until_pushed(self) -> None:
        """Waits until the plant moves: a plant that is not pushed cannot become safe."""
        until(lambda: not self._rests(), "the plant is not pushed")

    def watched(self) -> Watch:
        """Starts to observe the plant until it is safe."""
        return Watch(self)

    def _rests(self) -> bool:
        state = self.state()
        return state is None or self.speed(state) == 0.0

    @staticmethod
    def speed(state: dict[str, Any]) -> float:
        """Returns the speed of the drive."""
        _position, velocity = struct.unpack_from("dd", bytes(state["readings"]))
        return velocity

    def state(self) -> dict[str, Any] | None:
        text = _native.plant_state(self.name)
        return None if text is None else json.loads(text)


class Watch:
    """Observer of a plant until it is safe."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._safe_ns: int | None = None
        self._by_guard = False
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    def safe_s(self, begin_ns: int | None) -> float | None:
        """Returns the time to safety from an instant of CLOCK_MONOTONIC, s; `None` if the plant did not become safe within the limit."""
        self._looking.join(2 * LIMIT_S)
        return None if self._safe_ns is None or begin_ns is None else max(0, self._safe_ns - begin_ns) * 1e-9

    @property
    def by_guard(self) -> bool:
        """True if the guard made the plant safe."""
        self._looking.join(2 * LIMIT_S)
        return self._by_guard

    def _look(self) -> None:
        with contextlib.suppress(TimeoutError):
            until(self._is_safe, "the plant is not safe")

    def _is_safe(self) -> bool:
        # The plant itself reports when it obeyed the guard. The commands of its driver are seen from here, a step or two later.
        state, seen_ns = self._plant.state(), time.monotonic_ns()
        if state is not None and (state["is_safe"] or self._plant.speed(state) == 0.0):
            self._by_guard = state["is_safe"]
            self._safe_ns = state["obeyed_ns"] if self._by_guard else seen_ns
        return self._safe_ns is not None


def until(holds: Callable[[], bool], otherwise: str) -> None:
    """Polls a condition until it holds; raises `TimeoutError` after the limit."""
    end = time.monotonic() + LIMIT_S
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError(f"{otherwise} after {LIMIT_S:.0f} s")
