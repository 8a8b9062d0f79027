# SPDX-License-Identifier: Apache-2.0
"""Closed-form inverse kinematics, for arms of six revolute joints with the axes of most industrial arms.

The first axis is perpendicular to the second, the second parallel to the third. Either the last three axes intersect in one point (a
spherical wrist), or the fourth is parallel to the third and the fifth intersects both its neighbours (Universal Robots arms). Other
chains have no closed form here. Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, 1994, section 3.3,
which defines subproblems 1 and 3; Elias, Wen, IK-Geo, Mechanism and Machine Theory 209, 2025.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..values.configurations import Configuration
from ..values.frames import Pose

if TYPE_CHECKING:
    from .kinematics import Kinematics

_JOINTS = 6
_EXACT = 1e-6
"""Tolerance for axes that intersect (m), or are parallel or perpendicular (sine)."""

_STRAIGHT = 1e-7
"""Sine of the wrist angle below which the fourth and sixth axes are considered parallel."""

_ROUNDING = 1e-9
"""Tolerance by which a cosine may exceed 1 at the limit of the arm's reach."""


class ClosedForms:
    """Inverse kinematics of such an arm: all joint positions for a pose, and the configuration of joint positions. Created by
    `ClosedForms.of`."""

    def __init__(self, kinematics: Kinematics, joints: Sequence[int], wrist: np.ndarray, centre: np.ndarray, *, spherical: bool) -> None:
        self._kinematics = kinematics
        self._joints = list(joints)
        self._a = [np.array(kinematics.axes[j].direction) for j in joints]
        self._p = [np.array(kinematics.axes[j].point) for j in joints]
        self._wrist, self._centre, self._spherical = wrist, centre, spherical

    @classmethod
    def of(cls, kinematics: Kinematics) -> ClosedForms | None:
        """Returns the closed-form solution of a chain, or None if its axes do not have a supported arrangement."""
        joints = [j for j, axis in enumerate(kinematics.axes) if axis.kind]
        if len(joints) != _JOINTS or any(kinematics.axes[j].kind != 1 for j in joints):
            return None
        a = [np.array(kinematics.axes[j].direction) for j in joints]
        p = [np.array(kinematics.axes[j].point) for j in joints]
        wrist, centre = _meeting(a[3], p[3], a[4], p[4]), _meeting(a[4], p[4], a[5], p[5])
        if wrist is None or centre is None or abs(a[0] @ a[1]) > _EXACT or not _are_parallel(a[1], a[2]):
            return None
        spherical = bool(np.linalg.norm(wrist - centre) < _EXACT)
        return cls(kinematics, joints, wrist, centre, spherical=spherical) if spherical or _are_parallel(a[2], a[3]) else None

    @property
    def joints(self) -> list[int]:
        """Indices in the chain of the joints that move the tool."""
        return self._joints

    def configuration(self, q: np.ndarray) -> Configuration:
        """Returns the configuration of joint positions."""
        turns = [_turns(q[j]) for j in self._joints]
        return Configuration(*self._signs([q[j] for j in self._joints]), turns=tuple(turns))

    def all(self, pose: Pose, near: np.ndarray) -> list[np.ndarray]:
        """Returns the joint positions for a pose, at most eight, each within half a turn of 0; joints that do not move the tool keep
        their position in `near`.

        If the fourth and the sixth axis are parallel, the sixth joint keeps its position in `near`.
        """
        k = self._kinematics
        goal = (k.base.inverse() @ pose @ k.tool.inverse() @ k.home.inverse()).matrix
        found = []
        for angles in (self._with_sphere if self._spherical else self._with_parallel)(goal, near[self._joints[5]]):
            q = near.copy()
            q[self._joints] = [_principal(angle) for angle in angles]
            found.append(q)
        return found

    def _signs(self, angles: Sequence[float]) -> tuple[int, int, int]:
        turn, place = np.eye(3), np.zeros(3)
        a, p, frames = [], [], []
        for axis, point, angle in zip(self._a, self._p, angles, strict=True):
            a.append(turn @ axis)
            p.append(turn @ point + place)
            own = _rotation(axis, angle)
            turn, place = turn @ own, turn @ (point - own @ point) + place
            frames.append((turn, place))
        wrist = frames[3][0] @ self._wrist + frames[3][1]
        centre = frames[4][0] @ self._centre + frames[4][1]
        shoulder = np.cross(a[0], a[1]) @ (centre - p[0])
        elbow = np.cross(p[2] - p[1], wrist - p[2]) @ a[1]
        return _sign(shoulder), _sign(elbow), _sign(np.cross(a[3], a[5]) @ a[4])

    def _shoulders(self, goal: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
        """Yields each first angle and its inverse rotation; the other joints do not move the wrist centre along the second axis."""
        a, p = self._a, self._p
        centre = goal[:3, :3] @ self._centre + goal[:3, 3]
        for angle in _heights(a[1], a[0], centre - p[0], a[1] @ (self._centre - p[0])):
            yield -angle, _rotation(a[0], angle)

    def _bends(self, there: np.ndarray, of: np.ndarray) -> Iterator[tuple[float, float]]:
        """Yields each pair of second and third angles that bring the point `of` to `there`; both points are expressed in the frame after
        the first joint."""
        a, p = self._a, self._p
        upper = p[1] - p[2]
        fore = of - p[2]
        square = (there - p[1]) @ (there - p[1])
        for third in _heights(upper, a[2], fore, (fore @ fore + upper @ upper - square) / 2):
            bent = _rotation(a[2], third) @ fore + p[2]
            yield _angle(a[1], bent - p[1], there - p[1]), third

    def _with_parallel(self, goal: np.ndarray, near: float) -> Iterator[list[float]]:
        a, p = self._a, self._p
        for first, back in self._shoulders(goal):
            turn = back @ goal[:3, :3]
            place = back @ (goal[:3, 3] - p[0]) + p[0]
            for fifth in _heights(a[1], a[4], a[5], a[1] @ (turn @ a[5])):
                tilted = _rotation(a[4], -fifth) @ a[1]
                sixth = near if _are_parallel(tilted, a[5], _STRAIGHT) else -_angle(a[5], tilted, turn.T @ a[1])
                last, before = _rotation(a[5], -sixth), _rotation(a[4], -fifth)
                # Wrist beyond the fourth joint: remove the motion of the last two joints from the goal.
                point = last @ (before @ (self._wrist - p[4]) + p[4] - p[5]) + p[5]
                there = turn @ point + place
                for second, third in self._bends(there, self._wrist):
                    arm = _rotation(a[2], -third) @ _rotation(a[1], -second)
                    yield [first, second, third, _angle_of(a[3], arm @ turn @ last @ before), fifth, sixth]

    def _with_sphere(self, goal: np.ndarray, near: float) -> Iterator[list[float]]:
        a, p = self._a, self._p
        for first, back in self._shoulders(goal):
            there = back @ (goal[:3, :3] @ self._centre + goal[:3, 3] - p[0]) + p[0]
            for second, third in self._bends(there, self._centre):
                turn = _rotation(a[2], -third) @ _rotation(a[1], -second) @ back @ goal[:3, :3]
                for fifth in _heights(a[3], a[4], a[5], a[3] @ (turn @ a[5])):
                    bent = _rotation(a[4], fifth) @ a[5]
                    if _are_parallel(bent, a[3], _STRAIGHT):
                        rest = turn @ _rotation(a[5], -near) @ _rotation(a[4], -fifth)
                        yield [first, second, third, _angle_of(a[3], rest), fifth, near]
                        continue
                    fourth = _angle(a[3], bent, turn @ a[5])
                    rest = _rotation(a[4], -fifth) @ _rotation(a[3], -fourth) @ turn
                    yield [first, second, third, fourth, fifth, _angle_of(a[5], rest)]


def in_turn(angle: float, turn: int, near: float) -> float:
    """Returns the angle shifted to that turn; on the boundary between two turns, the angle nearer to `near`."""
    there = _principal(angle) + 2 * math.pi * turn
    over = there - math.copysign(2 * math.pi, _principal(angle))
    at_edge = math.pi - abs(_principal(angle)) < _EXACT
    return over if at_edge and abs(over - near) < abs(there - near) else there


def _principal(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def _turns(angle: float) -> int:
    return round((angle - _principal(angle)) / (2 * math.pi))


def _sign(value: Any) -> int:
    return 1 if value >= 0 else -1


def _are_parallel(a: np.ndarray, b: np.ndarray, sine: float = _EXACT) -> bool:
    return bool(np.linalg.norm(np.cross(a, b)) < sine * np.linalg.norm(a) * np.linalg.norm(b))


def _meeting(a: np.ndarray, p: np.ndarray, b: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """Returns the intersection of two axes, or None if they do not intersect."""
    across = np.cross(a, b)
    square = across @ across
    if square < _EXACT:
        return None
    if abs((q - p) @ across) > _EXACT * math.sqrt(square):
        return None
    return p + a * (np.cross(q - p, b) @ across / square)


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)


def _angle(axis: np.ndarray, p: np.ndarray, q: np.ndarray) -> float:
    """Returns the angle about the axis from `p` to `q`, both projected along the axis (subproblem 1)."""
    p, q = p - axis * (axis @ p), q - axis * (axis @ q)
    return math.atan2(axis @ np.cross(p, q), p @ q)


def _angle_of(axis: np.ndarray, turn: np.ndarray) -> float:
    """Returns the angle of a rotation about the axis."""
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    return _angle(axis, across, turn @ across)


def _heights(h: np.ndarray, axis: np.ndarray, p: np.ndarray, d: Any) -> list[float]:
    """Returns the angles (at most two) by which `p` must be rotated about the axis so that its component along `h` is `d` (subproblem
    4)."""
    along = (h @ axis) * (axis @ p)
    a, b = h @ p - along, h @ np.cross(axis, p)
    length = math.hypot(a, b)
    if length < _ROUNDING or abs(d - along) > length * (1 + _ROUNDING):
        return []
    middle, apart = math.atan2(b, a), math.acos(max(-1.0, min(1.0, (d - along) / length)))
    return [middle + apart, middle - apart]
