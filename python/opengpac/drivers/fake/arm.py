# SPDX-License-Identifier: Apache-2.0
"""Arm behind an emulated controller: joints that follow their goals at limited speed, and the controller commands that move them."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from typing import Any

import numpy as np

CYCLE = 0.002
"""Controller cycle, s."""
HOME = [0.0, -math.pi / 2, 0.0, -math.pi / 2, 0.0, 0.0]
SPEED_MAX = 3.3
"""Maximum speed of the joints, rad/s: slightly above the maximum that a program may command."""

# a, d, alpha of each joint of a UR5e, as published by its manufacturer.
_DH = [
    (0.0, 0.1625, math.pi / 2), (-0.425, 0.0, 0.0), (-0.3922, 0.0, 0.0), (0.0, 0.1333, math.pi / 2), (0.0, 0.0997, -math.pi / 2),
    (0.0, 0.0996, 0.0),
]  # fmt: skip


class RefusedCommand(Exception):
    """Raised when the safety system rejects a command; the arm is then in a protective stop."""


class JointArm:
    """Six joints, each of which reaches its goal one cycle later, or moves towards it at maximum speed."""

    def __init__(self, position: Sequence[float], leap_max: float) -> None:
        self.q = [float(value) for value in position]
        self.velocity = [0.0] * 6
        self.goal = [*self.q]
        self.leap_max = leap_max
        self.step_max = 0.0
        """Maximum step of a goal between two cycles so far, rad."""

    def command(self, goal: Sequence[float]) -> None:
        """Sets the next goal. Raises `RefusedCommand` if it is too far from the previous one."""
        if len(goal) != 6:
            raise ValueError(f"a goal must have 6 joint positions, not {len(goal)}")
        step = max(abs(to - before) for to, before in zip(goal, self.goal, strict=True))
        self.step_max = max(self.step_max, step)
        if step > self.leap_max:
            raise RefusedCommand(f"a goal is {step:.3f} rad from the previous one, more than {self.leap_max:g} rad")
        self.goal = [float(value) for value in goal]

    def rest(self) -> None:
        """Holds the current position."""
        self.goal, self.velocity = [*self.q], [0.0] * 6

    def advance(self) -> None:
        """Advances the simulation by one cycle."""
        most = SPEED_MAX * CYCLE
        steps = [min(max(goal - q, -most), most) for goal, q in zip(self.goal, self.q, strict=True)]
        self.q = [q + step for q, step in zip(self.q, steps, strict=True)]
        self.velocity = [step / CYCLE for step in steps]

    def touch(self) -> list[float]:
        """Returns the contact force on the tool, N, which is zero: this arm touches nothing."""
        return [0.0, 0.0, 0.0]

    def pose(self) -> list[float]:
        """Returns the pose of the flange in the controller's format: x, y, z and a rotation vector."""
        whole = np.eye(4)
        for q, (a, d, alpha) in zip(self.q, _DH, strict=True):
            ct, st, ca, sa = math.cos(q), math.sin(q), math.cos(alpha), math.sin(alpha)
            whole = whole @ np.array([[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]])
        rotation = whole[:3, :3]
        axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]) / 2
        sine, cosine = float(np.linalg.norm(axis)), (float(np.trace(rotation)) - 1) / 2
        angle = math.atan2(sine, cosine)
        if sine > 1e-6:
            turned = axis / sine * angle
        elif cosine > 0:
            turned = np.zeros(3)
        else:
            # Rotation by π: each column of R + 1 is parallel to the axis.
            along = max((rotation + np.eye(3)).T, key=lambda column: float(np.linalg.norm(column)))
            turned = along / np.linalg.norm(along) * math.pi
        return [*whole[:3, 3].tolist(), *turned.tolist()]


def motions(arm: JointArm) -> dict[str, Callable[..., Generator[None, None, Any]]]:
    """Returns the motion commands that a program can call, which take time."""

    def wait(seconds: float = CYCLE, *_: Any) -> Generator[None, None, None]:
        for _cycle in range(max(1, round(seconds / CYCLE))):
            yield

    def servoj(q: list[float], *more: float, t: float = CYCLE, **_: float) -> Generator[None, None, None]:
        arm.command(q)
        # Positional arguments: acceleration, speed, time.
        yield from wait(more[2] if len(more) > 2 else t)

    def stopj(*_: float, **__: float) -> Generator[None, None, None]:
        arm.rest()
        yield

    def speedj(qd: list[float], *more: float, a: float = 1.0, t: float = CYCLE) -> Generator[None, None, None]:
        for _cycle in range(max(1, round((more[1] if len(more) > 1 else t) / CYCLE))):
            arm.command([q + speed * CYCLE for q, speed in zip(arm.goal, qd, strict=True)])
            yield

    def movej(q: list[float], *more: float, a: float = 1.4, v: float = 1.05, t: float = 0.0, r: float = 0.0) -> Generator[None, None, None]:
        speed = more[1] if len(more) > 1 else v
        while any(abs(goal - to) > 1e-12 for goal, to in zip(arm.goal, q, strict=True)):
            most = max(abs(to - goal) for goal, to in zip(arm.goal, q, strict=True))
            share = min(1.0, speed * CYCLE / most)
            arm.command([to if share == 1.0 else goal + share * (to - goal) for goal, to in zip(arm.goal, q, strict=True)])
            yield
        yield

    return {
        "sync": lambda: wait(), "sleep": wait, "servoj": servoj, "stopj": stopj, "stopl": stopj, "speedj": speedj, "movej": movej,
        "force_mode": lambda *_, **__: wait(), "end_force_mode": lambda *_, **__: wait(),
    }  # fmt: skip
