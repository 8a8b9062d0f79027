# SPDX-License-Identifier: Apache-2.0
"""The motions of a joint that a page offers by itself."""

from __future__ import annotations

from typing import Any

from ..robots.joints import Joint
from .moves import move_absolute, move_relative
from .velocity import jog, stop

HEARTBEAT = "studio.heartbeat"
"""SVV into which the page writes while a button is held: jogging ends where it stands still."""


def enter_for(device: Any) -> None:
    """Enters the motions in the system of `device`, if that is a joint. What a program has defined or made under a name stays."""
    if not isinstance(device, Joint):
        return
    system = device.system
    known = system.names
    for verb in (jog, move_absolute, move_relative, stop):
        if verb.name not in known["verbs"]:
            system._enter_verb(verb)
    if HEARTBEAT not in known["svvs"]:
        system.svv(HEARTBEAT, int)
