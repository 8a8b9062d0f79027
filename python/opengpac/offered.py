# SPDX-License-Identifier: Apache-2.0
"""Motions that a page offers without a line of program: where a system has joints, the library's verbs for them are entered there."""

from __future__ import annotations

from typing import Any

HEARTBEAT = "studio.heartbeat"
"""SVV into which the page writes while a button is held: jogging ends where it stands still."""


def offer(system: Any, role: str) -> None:
    """Enters the motions for the joints that the system has, and for those that it gets, where the page may start them."""
    if role == "observe" or system.session is not None:
        return
    system._offers_motions = True
    for device in system.devices.values():
        offer_for(device)


def offer_for(device: Any) -> None:
    """Enters the motions, if `device` is a joint. What a program has defined or made under a name stays."""
    system = device.system
    if not system._offers_motions:
        return
    from . import motion
    from .robots import Joint

    if not isinstance(device, Joint):
        return
    known = system.names
    for verb in (motion.jog, motion.move_absolute, motion.move_relative, motion.stop):
        if verb.name not in known["verbs"]:
            system._enter_verb(verb)
    if HEARTBEAT not in known["svvs"]:
        system.svv(HEARTBEAT, int)
