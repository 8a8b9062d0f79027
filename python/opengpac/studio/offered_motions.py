# SPDX-License-Identifier: Apache-2.0
"""Motions that the studio offers without any action by the program: registers the library's verbs for joints and arms in systems that
have them.

Systems and devices are layered below the motions, so the package, which is layered above both, registers the motions here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_loaders: list[Callable[[], Callable[[Any, bool], None]]] = []


def enters_with(load: Callable[[], Callable[[Any, bool], None]]) -> None:
    """Registers a loader for the function that registers the motions of a device or an arm. The loader is called when the studio offers
    motions."""
    _loaders.append(load)


def offer(system: Any, role: str) -> None:
    """Registers the motions of the system's current and future devices and arms, if the role of the studio's page may start them.

    For a page that only observes, arms are described, but no motion is registered.
    """
    if system.session is not None:
        return
    system._page_role = role
    for moved in (*system.devices.values(), *system._arms.values()):
        offer_for(moved)


def offer_for(moved: Any) -> None:
    """Registers the motions of a device or an arm if its system is shown in the studio."""
    if (role := moved.system._page_role) is not None:
        for load in _loaders:
            load()(moved, role != "observe")
