# SPDX-License-Identifier: Apache-2.0
"""Loads one robot file as it is, or an arm by its name, holds it, moves it, and prints what came of it as a line of JSON.

`python tests/robots/one.py FILE|NAME`
"""

from __future__ import annotations

import importlib
import json
import re
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import sketch

import opengpac as gpac
from opengpac.robots import mjcf, urdf
from opengpac.robots.catalogue import KNOWN

mujoco: Any = importlib.import_module("mujoco")

ARRIVED = {"rad": 1e-3, "m": 1e-4}
"""How far from its goal a joint has arrived, 1 mrad or 0.1 mm."""
SHARE = 0.1
"""The part of its range by which each joint is moved."""
UNLIMITED = 100.0
"""A range above this has no ends worth a tenth of; a joint is moved by `STEP` then, rad or m."""
STEP = 0.3
SETTLING = "1 s"
"""How long after the end of a move a joint may settle."""
EFFORT_UNREAL, SPEED_UNREAL = 1e3, 100.0
"""An effort that all joints of an arm have alike, and a speed, that stand in files of arms which have others, N.m and rad/s."""
HELD = 500
"""Values of the servo, 1 ms each, over which the ripple is taken."""


def main(file: str) -> None:
    """Prints `{"joints": …, "ripple": …, "missed": [joint, …], "why": …}`; `why` is empty where all is well."""
    found: dict[str, Any] = {"joints": 0, "ripple": None, "missed": [], "why": ""}
    warnings.simplefilter("ignore")
    try:
        arm = gpac.robots.load(file, name="arm", clock="virtual")
        found["joints"], found["notes"] = len(arm), len(arm.notes)
        if file in KNOWN:
            found["sketch"] = sketch.chain(arm, arm.values("home"))
            found["speeds"], found["efforts"] = limits(arm, KNOWN[file].file())
        arm.enable()
        try_to_move(arm, found)
        if found["why"]:
            found["why"] += touching(arm, KNOWN[file].file() if file in KNOWN else Path(file))
    except (gpac.Error, ValueError) as error:
        found["why"] = f"{type(error).__name__}: {sentence(error)}"
    print(json.dumps(found), flush=True)


def limits(arm: Any, file: Path) -> tuple[list[float | None], list[float | None]]:
    """The speed and the effort of each joint, nothing where its file says none, or one that exporters write who know none."""
    speeds = urdf.convert(file).speeds if urdf.is_urdf(file) else {}
    said = arm.values("max_speed") if file.parent == Path(gpac.robots.__file__).parent else [speeds.get(j.short_name, 0.0) for j in arm]
    efforts = arm.values("max_effort")
    unreal = min(efforts) == max(efforts) >= EFFORT_UNREAL
    return (
        [speed if 0.0 < speed < SPEED_UNREAL else None for speed in said],
        [None if unreal or effort > 100.0 * EFFORT_UNREAL else effort for effort in efforts],
    )


def try_to_move(arm: Any, found: dict[str, Any]) -> None:
    """Holds the arm at home for 2 s, moves each joint there and back, then all at once."""
    arm.system.advance("2 s")
    found["ripple"] = max(float(np.ptp(joint.sensed.history[-HELD:]["value"])) for joint in arm)
    low, high = np.array(arm.values("position_min")), np.array(arm.values("position_max"))
    home = np.clip(arm.values("sensed"), low, high)
    step = np.where(high - low < UNLIMITED, SHARE * (high - low), STEP)
    step = np.where(home + step <= high, step, -step)
    for index in range(len(arm)):
        if not (reach(arm, home + step * (np.arange(len(arm)) == index), found) and reach(arm, home, found)):
            return
    reach(arm, home + step, found)


def reach(arm: Any, goal: np.ndarray, found: dict[str, Any]) -> bool:
    """Moves to a goal; false, with the joints that missed it and why, where it was not reached."""
    try:
        gpac.motion.move_absolute(arm, [float(q) for q in goal], time_limit="30 s")
    except gpac.Terminated as error:
        found["why"] = sentence(error)
        return False
    arm.system.advance(SETTLING)
    near = [ARRIVED[joint.sensed.unit] for joint in arm]
    far = [joint.short_name for joint, q, at, most in zip(arm, goal, arm.values("sensed"), near, strict=False) if abs(q - at) > most]
    found["missed"] = far
    if far:
        found["why"] = "off its goal: " + ", ".join(far)
    return not found["why"]


def touching(arm: Any, file: Path) -> str:
    """Names the links of an MJCF model that touch each other where the arm has come to a stop."""
    if urdf.is_urdf(file):
        return ""
    text, _, _ = mjcf.put_right(file)
    model = mujoco.MjModel.from_xml_path(str(file)) if text is None else mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for joint, position in zip(arm, arm.values("sensed"), strict=True):
        data.qpos[model.jnt_qposadr[model.joint(joint.short_name).id]] = position
    mujoco.mj_forward(model, data)
    pairs = {tuple(sorted(called(model, geom) for geom in contact.geom)) for contact in data.contact}
    return "".join(f"; '{first}' touches '{second}'" for first, second in sorted(pairs))


def called(model: Any, geom: int) -> str:
    """The name of a shape's link; of what belongs to no link its own."""
    body = model.geom_bodyid[geom]
    return model.body(body).name if body else model.geom(geom).name or "world"


def sentence(error: Exception) -> str:
    """What an error says, without the place in this program."""
    lines = str(error).splitlines()
    # An error of several parts begins with their number.
    first = lines[1].strip() if len(lines) > 1 and lines[0].endswith("wrong:") else lines[0]
    # What a following error says of efforts and remedies is not what this page is about.
    return re.sub(r"(?<='following_error'): .*| at \S*one\.py:\d+$", "", first)


if __name__ == "__main__":
    main(sys.argv[1])
