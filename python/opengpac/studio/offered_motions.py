# SPDX-License-Identifier: Apache-2.0
"""Motions that a page offers without any program: the library's verbs for joints and arms are registered in a system that has them.

Systems and devices are layered below the motions, so the package, which is layered above both, registers the motions here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_loaders: list[Callable[[], Callable[[Any, bool], None]]] = []


def enters_with(load: Callable[[], Callable[[Any, bool], None]]) -> None:
    """Registers a loader of the function that enters the motions for a device or an arm; it is called when a page offers motions."""
    _loaders.append(load)


def offer(system: Any, role: str) -> None:
    """Enters the motions for the devices and arms that the system has, and for those that it gets, where the page may start them.

    For a page that may only look, arms are described and nothing is entered.
    """
    if system.session is not None:
        return
    system._page_role = role
    for moved in (*system.devices.values(), *system._arms.values()):
        offer_for(moved)


def offer_for(moved: Any) -> None:
    """Enters the motions for a device or an arm, where its system has a page."""
    if (role := moved.system._page_role) is not None:
        for load in _loaders:
            load()(moved, role != "observe")
