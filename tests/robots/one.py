# SPDX-License-Identifier: Apache-2.0
"""Loads one robot file as it is, or an arm of the catalogue, holds it, moves it, and prints the result as a line of JSON.

`python tests/robots/one.py FILE|NAME [PICTURE]`
"""

from __future__ import annotations

import json
import re
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from efforts import Efforts
from scene import Scene

import opengpac as gpac
from opengpac.robots import sketch, urdf
from opengpac.robots.catalogue import KNOWN

ARRIVED = {"rad": 1e-3, "m": 1e-4}
"""Maximum distance of an arrived joint from its goal, 1 mrad or 0.1 mm."""
SHARE = 0.1
"""Fraction of its range by which each joint is moved."""
UNLIMITED = 100.0
"""A range above this is treated as unlimited; a joint is then moved by `STEP`, rad or m."""
STEP = 0.3
SETTLING = "1 s"
"""Settling time of a joint after the end of a move."""
EFFORT_UNREAL, SPEED_UNREAL = 1e3, 100.0
"""Placeholder values in files: an effort that all joints of an arm have alike, and a speed, N.m and rad/s."""
HELD = 500
"""Number of values of the servo, 1 ms each, over which the ripple is measured."""
REVERSALS_HZ = 50.0
"""Maximum rate at which an effort may alternate."""
TOGETHER = 16
"""Maximum number of joints of one motion; a hand or a robot with more is moved in parts."""
TRIES = 64
"""Number of choices of directions that are tried for a move of all joints."""


def main(file: str, picture: str = "") -> None:
    """Prints `{"joints": …, "ripple": …, "missed": [joint, …], "why": …}`; `why` is empty if all is well."""
    found: dict[str, Any] = {"joints": 0, "ripple": None, "reversals": 0.0, "missed": [], "why": ""}
    warnings.simplefilter("ignore")
    try:
        arm = gpac.robots.load(file, name="arm", clock="virtual")
        found["joints"], found["notes"] = len(arm), len(arm.notes)
        if file in KNOWN:
            found["sketch"] = sketch.chain(arm, arm.values("home"))
            found["speeds"], found["efforts"] = limits(arm, KNOWN[file].file())
        scene = Scene(KNOWN[file].file() if file in KNOWN else Path(file), [joint.name.removeprefix("arm.") for joint in arm])
        if picture:
            scene.paint(arm.values("home"), Path(picture))
        arm.enable()
        try_to_move(arm, scene, Efforts(arm), found)
        if found["why"]:
            found["why"] += "".join(f"; '{first}' touches '{second}'" for first, second in sorted(scene.touching(arm.values("sensed"))))
    except (gpac.Error, ValueError) as error:
        found["why"] = f"{type(error).__name__}: {sentence(error)}"
    print(json.dumps(found), flush=True)


def limits(arm: Any, file: Path) -> tuple[list[float | None], list[float | None]]:
    """Returns the speed and the effort of each joint; `None` if its file declares none, or a placeholder of exporters."""
    speeds = urdf.convert(file).speeds if urdf.is_urdf(file) else {}
    said = arm.values("max_speed") if file.parent == Path(gpac.robots.__file__).parent else [speeds.get(j.short_name, 0.0) for j in arm]
    efforts = arm.values("max_effort")
    unreal = min(efforts) == max(efforts) >= EFFORT_UNREAL
    return (
        [speed if 0.0 < speed < SPEED_UNREAL else None for speed in said],
        [None if unreal or effort > 100.0 * EFFORT_UNREAL else effort for effort in efforts],
    )


def try_to_move(arm: Any, scene: Scene, efforts: Efforts, found: dict[str, Any]) -> None:
    """Holds the arm at home for 2 s, moves each joint there and back, then all at once, each in a direction without obstacles."""
    arm.system.advance("2 s")
    found["ripple"] = max(float(np.ptp(joint.sensed.history[-HELD:]["value"])) for joint in arm)
    lost = [joint.short_name for joint in arm if joint.state != "standstill"]
    if lost:
        told = [*(too_weak(arm, name) for name in lost), *(alarm.text for alarm in arm.system.alarms.active)]
        found["missed"], found["why"] = lost, "; ".join(filter(None, told)) or "does not hold at its home: " + ", ".join(lost)
    if lost or bangs(arm, efforts, found):
        return
    low, high = np.array(arm.values("position_min")), np.array(arm.values("position_max"))
    home = np.clip(arm.values("sensed"), low, high)
    size = np.where(high - low < UNLIMITED, SHARE * (high - low), STEP)
    forwards, backwards = home + size <= high, home - size >= low
    side = np.where(forwards, 1.0, -1.0)
    for index in range(len(arm)):
        one = np.arange(len(arm)) == index
        if forwards[index] and backwards[index] and not scene.is_free(home, home + size * one) and scene.is_free(home, home - size * one):
            side[index] = -1.0
        if not (reach(arm, efforts, home + side * size * one, found) and reach(arm, efforts, home, found)):
            return
    chance = np.random.default_rng(0)
    for _ in range(TRIES):
        if scene.is_free(home, home + side * size):
            break
        side = np.where(forwards & backwards, chance.choice([-1.0, 1.0], len(arm)), side)
    reach(arm, efforts, home + side * size, found)


def too_weak(arm: Any, joint: str) -> str:
    """Returns the note at load about a joint whose motor cannot hold or move it."""
    told = (note.partition(": ")[2] for note in arm.notes if f"joint '{joint}'" in note and "but its motor has" in note)
    return next(told, "").partition("; ")[0]


def reach(arm: Any, efforts: Efforts, goal: np.ndarray, found: dict[str, Any]) -> bool:
    """Moves to a goal; returns false and notes the joints that missed it, and why, if it was not reached."""
    for first in range(0, len(arm), TOGETHER):
        part = arm if len(arm) <= TOGETHER else gpac.Group(f"part{first}", *list(arm)[first : first + TOGETHER])
        try:
            gpac.motion.move_absolute(part, [float(q) for q in goal[first : first + TOGETHER]], time_limit="30 s")
        except gpac.Terminated as error:
            told = [too_weak(arm, joint.short_name) for joint in part if f"'{joint.name}'" in str(error)]
            found["why"] = "; ".join(filter(None, told)) or sentence(error)
            return False
    arm.system.advance(SETTLING)
    near = [ARRIVED[joint.sensed.unit] for joint in arm]
    far = [joint.short_name for joint, q, at, most in zip(arm, goal, arm.values("sensed"), near, strict=False) if abs(q - at) > most]
    found["missed"] = far
    if far:
        found["why"] = "off its goal: " + ", ".join(far)
    return not found["why"] and not bangs(arm, efforts, found)


def bangs(arm: Any, efforts: Efforts, found: dict[str, Any]) -> bool:
    """Returns whether the effort of a joint has reversed too fast since the last call; notes the joint and the rate."""
    rates = efforts.reversals()
    found["reversals"] = max(found["reversals"], *rates)
    if max(rates) > REVERSALS_HZ:
        found["why"] = f"the effort of {arm[int(np.argmax(rates))].short_name} reverses at {max(rates):.0f} Hz"
    return max(rates) > REVERSALS_HZ


def sentence(error: Exception) -> str:
    """Returns the message of an error, without the line of this program."""
    lines = str(error).splitlines()
    # An error of several parts begins with their number.
    first = lines[1].strip() if len(lines) > 1 and lines[0].endswith("wrong:") else lines[0]
    # The efforts and remedies in a following error do not concern this page.
    return re.sub(r"(?<='following_error'): .*| at \S*one\.py:\d+$", "", first)


if __name__ == "__main__":
    main(*sys.argv[1:])
