# SPDX-License-Identifier: Apache-2.0
"""The motions of joints and of arms that a page offers by itself."""

from __future__ import annotations

from typing import Any

from ..errors import Error, refusals
from ..robots.arm import Arm
from ..robots.joints import Joint
from ..robots.kinematics import JOINTS_MAX
from .line import move_linear
from .moves import move_absolute, move_relative
from .tool_jog import jog_linear
from .velocity import jog, stop

HEARTBEAT = "studio.heartbeat"
"""SVV into which the page writes while a button is held: jogging ends where it stands still."""


def enter_for(moved: Any) -> None:
    """Enters the motions of a joint or an arm in its system. What a program has defined or made under a name stays.

    Of an arm the system is told the geometry too, by which a page moves its tool.
    """
    if isinstance(moved, Joint):
        _enter(moved.system, jog, move_absolute, move_relative, stop)
        if HEARTBEAT not in moved.system.names["svvs"]:
            moved.system.svv(HEARTBEAT, int)
    elif isinstance(moved, Arm):
        _enter(moved.system, jog_linear, move_linear)
        with refusals:
            moved.system._alive().describe_arm(_described(moved))


def _enter(system: Any, *verbs: Any) -> None:
    known = system.names["verbs"]
    for verb in verbs:
        if verb.name not in known:
            system._enter_verb(verb)


def _described(arm: Arm) -> dict[str, Any]:
    """Returns an arm as the call `describe_arm` takes it, with its geometry or the reason why that is not known."""
    said: dict[str, Any] = {"name": arm.name, "joints": [joint.name for joint in arm]}
    if len(arm) > JOINTS_MAX:
        return {**said, "missing": f"it has {len(arm)} joints, and a motion takes at most {JOINTS_MAX}"}
    try:
        return {**said, "chain": arm.chain}
    except Error as error:
        return {**said, "missing": error.message}
    except (OSError, ValueError) as error:
        return {**said, "missing": str(error)}
