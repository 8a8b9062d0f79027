# SPDX-License-Identifier: Apache-2.0
"""Random compositions of motions come to rest, each joint within its limits, whatever ends them, and nothing begins afterwards.

The compositions vary with the day; a failure names its seed, and `OPENGPAC_MOVED_FROM=seed OPENGPAC_MOVED=1` runs that one again.
"""

from __future__ import annotations

import contextlib
import datetime
import os
import random
from typing import Any

import numpy as np

import opengpac as gpac
from opengpac import motion

Motion = gpac.Verb[..., Any] | gpac.ComposedVerb
CYCLE_S = 0.02
REST_S = 2.5
"""Time for which a trial is observed after its end."""
WITHIN_LIMITS = ("halt", "halt", "time limit", "suspend and halt", "abort")
SWITCHED_OFF = ("disable", "emergency stop")


class Cell:
    """System with two simulated arms, `left` and `right`, whose motions yield to new ones."""

    def __init__(self) -> None:
        self.system = gpac.System("resting", clock="virtual")
        rtp = self.system.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        rtp.timer("slow", period="20 ms", priority=60)
        self.left, self.right = (
            gpac.robots.load("two_joint", on=fast, name=name, arbitration="abort").enable() for name in ("left", "right")
        )
        self.all = gpac.Group("all", *self.left, *self.right)
        self.limits = np.array([(joint.max_speed, joint.max_acceleration, joint.max_jerk) for joint in self.all]).T

    def begin_again(self) -> None:
        """Switches everything on, and moves the arms to the start of trials."""
        self.system.reset()
        for arm in (self.left, self.right):
            arm.enable()
        motion.move_absolute(self.all, 0.0, speed="100 %")
        self.system.advance("100 ms")

    def way(self, speed: np.ndarray) -> np.ndarray:
        """Returns an upper bound of the distance that a joint travels in a stop from this speed, while it still accelerates."""
        _, acceleration, jerk = self.limits
        most = np.abs(speed) + acceleration**2 / (2 * jerk)
        return most**2 / (2 * acceleration) + most * (2 * acceleration / jerk + 2 * CYCLE_S)


class Drawn:
    """Random composition of motions of both arms, and the values of its inputs."""

    def __init__(self, rng: random.Random) -> None:
        self.rng, self.count = rng, 0
        self.inputs: dict[str, Any] = {}
        self.is_smooth = True
        """True if all motions of the composition limit their jerk."""
        self.verb = self.together() if rng.random() < 0.6 else self.chain("left", 2)

    def leaf(self, arm: str) -> Motion:
        """Returns one motion of an arm, with inputs and outputs of unique names."""
        rng, number = self.rng, self.number()
        goal = [rng.uniform(-1.2, 1.2) for _ in range(2)]
        kind = rng.choice(["absolute", "absolute", "relative", "velocity", "path", "stop"])
        verb, inputs = {
            "absolute": lambda: (motion.move_absolute, {"goal": goal, "speed": f"{rng.randint(10, 100)} %"}),
            "relative": lambda: (motion.move_relative, {"goal": [0.3 * to for to in goal], "speed": f"{rng.randint(10, 100)} %"}),
            "velocity": lambda: (motion.move_velocity, {"velocity": goal}),
            "path": lambda: (motion.follow, {"points": [[0.5 * to for to in goal], goal], "speed": rng.uniform(0.2, 1.5)}),
            "stop": lambda: (motion.stop, {}),
        }[kind]()
        self.is_smooth &= kind != "path"
        self.inputs |= {f"m{number}_{name}": value for name, value in inputs.items()}
        return gpac.compose(f"leaf{number}", {"m": verb}, rename={"m.arm": arm, "m.*": f"m{number}_*"})

    def number(self) -> int:
        self.count += 1
        return self.count

    def chain(self, arm: str, depth: int) -> Motion:
        """Returns up to `depth` + 1 consecutive motions of one arm, now and then in a loop."""
        first = self.chain(arm, depth - 1) if depth else self.leaf(arm)
        if not depth or self.rng.random() < 0.3:
            return first
        second = self.leaf(arm)
        back = {("b", None): "a"} if self.rng.random() < 0.2 else {}
        return gpac.compose(f"chain{self.number()}", {"a": first, "b": second}, transitions={("a", None): "b", **back})

    def together(self) -> Motion:
        """Returns motions of both arms at once, sometimes followed by one more of `left`."""
        goes_on = self.rng.random() < 0.5
        parts = {"l": self.leaf("left"), "r": self.leaf("right")}
        both = gpac.together(parts, name=f"both{self.number()}", until=self.rng.choice(["any", "all"]))
        if not goes_on:
            return both
        return gpac.compose(f"then{self.number()}", {"a": both, "b": self.leaf("left")}, transitions={("a", None): "b"})


def is_beyond(cell: Cell, begun_s: float, is_smooth: bool) -> str:
    """Returns where the joints exceeded their limits since an instant; empty if they did not."""
    for joint, (speed, acceleration, jerk) in zip(cell.all, cell.limits.T, strict=True):
        rows = joint.reference.history[:]
        value = rows["value"][rows["time"] >= begun_s - 1e-9]
        looks = [("rad/s", np.diff(value) / 1e-3, speed), ("rad/s²", np.diff(value, 2) / 1e-6, acceleration)]
        rows = joint.commanded.history[:]
        rows = rows[rows["time"] >= begun_s - 1e-9]
        if is_smooth:
            even = np.abs(np.diff(rows["time"]) - CYCLE_S) < 1e-6
            change = np.diff(rows["value"], 3) / CYCLE_S**3
            looks.append(("rad/s³", change[even[2:] & even[1:-1] & even[:-2]], jerk))
        for unit, found, limit in looks:
            if len(found) and np.abs(found).max() > limit * (1 + 1e-6) + 1e-6:
                return f"{joint.short_name}: {np.abs(found).max():.4g} {unit} of {limit:.4g}"
    return ""


def end(cell: Cell, moving: gpac.VerbInstance[Any], how: str) -> None:
    """Ends a motion in the given way; a time limit ends it by itself."""
    if how == "suspend and halt":
        moving.suspend()
    if how in ("halt", "suspend and halt"):
        moving.halt()
    elif how == "abort":
        motion.stop(cell.all)
    elif how == "disable":
        cell.left.disable()
        cell.right.disable()
    elif how == "emergency stop":
        cell.system.emergency_stop("tested")


def trial(cell: Cell, seed: int) -> bool:
    """Draws a composition and ends it at a random instant; returns false if the model refuses it or it had already ended."""
    rng = random.Random(seed)
    try:
        drawn = Drawn(rng)
    except gpac.Error:
        return False
    how, at_ms = rng.choice(WITHIN_LIMITS + SWITCHED_OFF), rng.randint(1, 1500)
    where = f"seed {seed}, {how} after {at_ms} ms: {drawn.verb!r} {drawn.inputs}"
    cell.begin_again()
    begun_s = cell.system.now
    arms: dict[str, Any] = {name: getattr(cell, name) for name in drawn.verb.objects}
    moving = drawn.verb.asynch(**arms, **drawn.inputs, **({"time_limit": f"{at_ms} ms"} if how == "time limit" else {}))
    cell.system.advance(f"{at_ms} ms")
    if moving.done:
        return False
    at = np.array([(joint.commanded.value, joint.setpoint_velocity.value) for joint in cell.all]).T
    end(cell, moving, how)
    cell.system.advance(f"{REST_S} s")
    assert moving.done, f"it still runs: {where}"
    with contextlib.suppress(gpac.Terminated):
        moving.wait()
    still_s = cell.system.now
    rest = np.array([joint.commanded.value for joint in cell.all])
    cell.system.advance("1 s")
    assert np.array_equal([joint.commanded.value for joint in cell.all], rest), (
        f"something moves {cell.system.now - still_s} s later: {where}"
    )
    assert (np.abs(rest - at[0]) <= cell.way(at[1])).all(), f"they went on by {rest - at[0]} rad: {where}"
    if how in WITHIN_LIMITS:
        assert max(abs(joint.commanded_velocity.value) for joint in cell.all) < 1e-9, where
        wrong = is_beyond(cell, begun_s, drawn.is_smooth)
        assert not wrong, f"{wrong}: {where}"
    return True


def test_motions_come_to_rest_within_their_limits_whatever_ends_them() -> None:
    count = int(os.environ.get("OPENGPAC_MOVED", "40"))
    first = int(os.environ.get("OPENGPAC_MOVED_FROM", datetime.date.today().toordinal() * 10_000))
    cell = Cell()
    with cell.system:
        tried = sum(trial(cell, seed) for seed in range(first, first + count))
    assert count == 1 or tried > count / 3, f"{count - tried} of {count} had ended before"
