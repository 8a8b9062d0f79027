# SPDX-License-Identifier: Apache-2.0
"""Verbs that the studio offers without any action by the program: motions of joints and arms, and the setting of outputs."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

from .. import checking
from ..cell.signals import AnalogOutput, DigitalOutput
from ..cell.verbs import set_output
from ..devices.points import model_of
from ..errors import Error, refusals
from ..robots.arm import Arm
from ..robots.joints import Joint
from ..robots.kinematics import JOINTS_MAX
from ..storage.cache import user_data
from .line import move_linear
from .moves import move_absolute, move_relative
from .tool_jog import jog_linear
from .velocity import jog, stop

HEARTBEAT = "studio.heartbeat"
"""SVV that the studio writes while a button is held; jogging ends when it stops changing."""


def enter_for(moved: Any, starts: bool) -> None:
    """Registers the verbs of a joint, an arm or an output in its system. Verbs that a program has defined under the same name are kept.

    If `starts` is false, the studio must not start verbs, and none is registered. For an arm, the system also receives its geometry
    and its points file.
    """
    if isinstance(moved, Arm):
        if starts:
            _enter(moved.system, jog_linear, move_linear)
        with refusals:
            moved.system._alive().describe_arm(_described(moved))
        _name_points(moved, starts)
    elif not starts:
        return
    elif isinstance(moved, Joint):
        _enter(moved.system, jog, move_absolute, move_relative, stop)
        if HEARTBEAT not in moved.system.names["svvs"]:
            moved.system.svv(HEARTBEAT, int)
    elif isinstance(moved, DigitalOutput | AnalogOutput):
        _enter(moved.system, set_output.verb(moved))


def _enter(system: Any, *verbs: Any) -> None:
    known = system.names["verbs"]
    for verb in verbs:
        if verb.name not in known:
            system._enter_verb(verb)


def _name_points(arm: Arm, teaches: bool) -> None:
    """Sets the points file of an arm for the studio: the file of the program's `Points`, or else a file of the user if the studio may
    teach."""
    named = arm.system._point_files.get(arm.name)
    path, any_model = named if named is not None else (_file_of_user(arm) if teaches else None, False)
    if path is None or arm.system.session is not None:
        return
    with refusals:
        arm.system._alive().name_points(
            arm.name, str(path), model_of(arm), arm.short_names, [joint.sensed.unit or "" for joint in arm], any_model
        )


def _file_of_user(arm: Arm) -> Path | None:
    """Returns the points file of an arm if the program has not set one; None if the user has no data folder, or if a program is only
    being checked."""
    if checking.active():
        return None
    try:
        folder = user_data() / "points"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    # Another model under the same name has points of its own.
    digest = hashlib.sha256(model_of(arm).encode()).hexdigest()[:8]
    return folder / f"{re.sub(r'[^A-Za-z0-9._-]', '_', arm.name)}-{digest}.toml"


def _described(arm: Arm) -> dict[str, Any]:
    """Returns an arm in the format of the request `describe_arm`, with its geometry, or the reason why it is unknown."""
    said: dict[str, Any] = {"name": arm.name, "joints": [joint.name for joint in arm]}
    if len(arm) > JOINTS_MAX:
        return {**said, "missing": f"it has {len(arm)} joints, but a motion can have at most {JOINTS_MAX}"}
    try:
        return {**said, "chain": arm.chain}
    except Error as error:
        return {**said, "missing": error.message}
    except (OSError, ValueError) as error:
        return {**said, "missing": str(error)}
