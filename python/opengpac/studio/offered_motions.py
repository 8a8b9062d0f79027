# SPDX-License-Identifier: Apache-2.0
"""Motions that a page offers without a line of program: where a system has joints, the library's verbs for them are entered there.

Systems and devices stand below the motions, so the package, which stands above both, says here where the motions are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_loaders: list[Callable[[], Callable[[Any], None]]] = []


def enters_with(load: Callable[[], Callable[[Any], None]]) -> None:
    """Registers what loads the function that enters the motions for a device; it is called when a page offers motions."""
    _loaders.append(load)


def offer(system: Any, role: str) -> None:
    """Enters the motions for the devices that the system has, and for those that it gets, where the page may start them."""
    if role == "observe" or system.session is not None:
        return
    system._offers_motions = True
    for device in system.devices.values():
        offer_for(device)


def offer_for(device: Any) -> None:
    """Enters the motions for a device, where its system offers them."""
    if device.system._offers_motions:
        for load in _loaders:
            load()(device)
