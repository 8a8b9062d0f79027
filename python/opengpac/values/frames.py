# SPDX-License-Identifier: Apache-2.0
"""Poses and frames: position and orientation. The core computes them with the arithmetic of the blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from .. import _native
from ..errors import ValueRefused, refusals, refuse
from .numbers import number


def _number(given: Any, unit: str, what: str) -> float:
    if isinstance(given, str):
        with refusals:
            return _native.number_in(given, unit)
    given = number(given)
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        refuse(
            ValueRefused,
            f"{what} must be a finite number, not {given!r}",
            f"write a number{f' in {unit}, or a string with a unit' if unit else ''}",
        )
    return float(given)


def _numbers(given: Any, unit: str, what: str, count: int) -> tuple[float, ...]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        refuse(ValueRefused, f"{what} must be {count} numbers, not {given!r}")
    found = tuple(_number(x, unit, f"a number of {what}") for x in given)
    if len(found) != count:
        refuse(ValueRefused, f"{what} must have {count} numbers, not {len(found)}")
    return found


def _angles(given: Any) -> tuple[float, ...]:
    """Returns roll, pitch and yaw. Plain numbers are rad; values beyond one turn are refused, because degrees were probably meant."""
    given = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else given
    found = _numbers(given, "rad", "rpy", 3)
    for what, angle, written in zip(("roll", "pitch", "yaw"), found, given, strict=True):
        if not isinstance(written, str):
            with refusals:
                _native.check_angle(f"the {what} of a pose", angle)
    return found


class Pose:
    """A `position` (m) and an orientation: of a tool, a workpiece, or a frame in another.

    `Pose((0.4, 0, 0.3), rpy=("180 deg", 0, 0))` rotates about the fixed x, then y, then z axis (roll, pitch, yaw; rad or text with a
    unit); `Pose((0.4, 0, 0.3), quaternion=(1, 0, 0, 0))` takes a unit quaternion, w first; without either there is no rotation. `a @
    b` is the pose `b` in frame `a`, expressed in the reference of `a`; `a @ point` transforms a point in `a`; `a.inverse()` is the
    inverse. A pose is immutable, and is a value of seven numbers: x, y, z, then the quaternion w, x, y, z. Raises `ValueRefused` for
    a position that is not three numbers, for a quaternion whose length is not 1, and if both orientations are passed; `UnitMismatch`
    for a unit of the wrong dimension, `OutOfRange` for plain numbers of `rpy` beyond one turn: degrees are text, `"90 deg"`.
    >>> Pose((0.4, "20 mm", 0.3), rpy=(0, 0, "90 deg")) @ Pose((0.1, 0, 0))
    Pose(0.4, 0.12, 0.3 m; rpy 0, 0, 90 deg)
    """

    __slots__ = ("_numbers",)
    _numbers: tuple[float, ...]

    def __init__(
        self,
        position: Iterable[Any] = (0.0, 0.0, 0.0),
        *,
        rpy: Iterable[Any] | None = None,
        quaternion: Iterable[float] | None = None,
    ) -> None:
        if rpy is not None and quaternion is not None:
            refuse(ValueRefused, "a pose cannot have both rpy and a quaternion", "pass one of them")
        place = _numbers(position, "m", "the position", 3)
        for coordinate in place:
            with refusals:
                _native.check_range("a coordinate of a pose", "m", coordinate)
        if quaternion is None:
            self._numbers = tuple(_native.pose_of_rpy(place, (0.0, 0.0, 0.0) if rpy is None else _angles(rpy)))
            return
        turn = _numbers(quaternion, "", "the quaternion", 4)
        unit = _native.pose_of((*place, *turn))
        if unit is None:
            refuse(
                ValueRefused,
                f"the quaternion {turn} must have length 1, not {math.hypot(*turn):.6g}",
                "write it with w first, and divide it by its length",
            )
        self._numbers = tuple(unit)

    @classmethod
    def _made(cls, numbers: Sequence[float]) -> Pose:
        """Creates the pose from the core's numbers."""
        made = cls.__new__(cls)
        made._numbers = tuple(numbers)
        return made

    @classmethod
    def of(cls, given: Pose | Sequence[float] | np.ndarray) -> Pose:
        """Converts seven numbers to a pose, x y z in m and the quaternion w x y z; returns a `given` pose unchanged."""
        if isinstance(given, Pose):
            return given
        numbers = _numbers(given, "", "a pose", 7)
        return cls(numbers[:3], quaternion=numbers[3:])

    @classmethod
    def by_points(
        cls, origin: Pose | Sequence[Any] | np.ndarray, on_x: Pose | Sequence[Any] | np.ndarray, in_xy: Pose | Sequence[Any] | np.ndarray
    ) -> Pose:
        """Returns the frame with this `origin`, whose x axis passes through the second point and whose xy plane passes through the
        third, on the side of positive y.

        Points are x y z (m or text with a unit) or poses, whose orientation is ignored:
        `Frame.by_points(*[arm.forward(points[name].array) for name in ("corner", "along", "beside")])`. Raises `ValueRefused` if the
        second point is less than 1 mm from the origin, or the third less than 1 mm from the x axis.
        """
        places = [
            place.position if isinstance(place, Pose) else np.array(_numbers(place, "m", "a place", 3)) for place in (origin, on_x, in_xy)
        ]
        x, other = places[1] - places[0], places[2] - places[0]
        length = float(np.linalg.norm(x))
        if length < _APART:
            refuse(
                ValueRefused,
                f"the point on the x axis is too close to the origin: {length:.3g} m",
                "choose one farther away, because its error rotates the frame",
            )
        x /= length
        y = other - (other @ x) * x
        beside = float(np.linalg.norm(y))
        if beside < _APART:
            refuse(
                ValueRefused,
                f"the point in the xy plane is too close to the x axis: {beside:.3g} m",
                "choose one farther away from the axis",
            )
        y /= beside
        return cls(tuple(places[0]), quaternion=_quaternion(np.column_stack([x, y, np.cross(x, y)])))

    @property
    def position(self) -> np.ndarray:
        """x, y, z in m."""
        return np.array(self._numbers[:3])

    @property
    def quaternion(self) -> np.ndarray:
        """Orientation as a unit quaternion w, x, y, z."""
        return np.array(self._numbers[3:])

    @property
    def rpy(self) -> np.ndarray:
        """Roll, pitch and yaw in rad: rotations about the fixed x, then y, then z axis. Pitch is within ± 90 degrees."""
        return np.array(_native.pose_rpy(self._numbers))

    @property
    def matrix(self) -> np.ndarray:
        """4 x 4 matrix that transforms points from this frame to its reference frame."""
        turned = (0.0, 0.0, 0.0, *self._numbers[3:])
        matrix = np.eye(4)
        for column, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
            matrix[:3, column] = _native.pose_point(turned, axis)
        matrix[:3, 3] = self._numbers[:3]
        return matrix

    def inverse(self) -> Pose:
        """Returns the inverse: the pose of the reference frame in this frame."""
        return self._made(_native.pose_inverse(self._numbers))

    def distance(self, other: Pose) -> float:
        """Returns the distance to the `other` pose, m."""
        return _native.pose_between(self._numbers, other._numbers)[0]

    def angle(self, other: Pose) -> float:
        """Returns the angle between the orientations of this and the `other` pose, rad, 0 to pi."""
        return _native.pose_between(self._numbers, other._numbers)[1]

    def __matmul__(self, other: Any) -> Any:
        if isinstance(other, Pose):
            return self._made(_native.pose_then(self._numbers, other._numbers))
        return np.array(_native.pose_point(self._numbers, _numbers(other, "m", "a point", 3)))

    def __iter__(self) -> Iterator[float]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return 7

    def __getitem__(self, index: int) -> float:
        return self._numbers[index]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pose) and self._numbers == other._numbers

    def __hash__(self) -> int:
        return hash(self._numbers)

    def __repr__(self) -> str:
        place = ", ".join(_short(x) for x in self._numbers[:3])
        turn = ", ".join(_short(math.degrees(x)) for x in self.rpy)
        return f"Pose({place} m; rpy {turn} deg)"


Frame = Pose
"""A frame, defined by its pose: `arm.tool = gpac.Frame((0, 0, "120 mm"))`."""


_APART = 1e-3
"""Minimum distance between points that define a frame, m; closer points do not define a direction."""


def _quaternion(turn: np.ndarray) -> tuple[float, ...]:
    """Returns the unit quaternion of a rotation matrix, computed from its largest component."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    squares = np.array([1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i])
    rows = np.array(
        [
            [squares[0], h - f, c - g, d - b],
            [h - f, squares[1], b + d, c + g],
            [c - g, b + d, squares[2], f + h],
            [d - b, c + g, f + h, squares[3]],
        ]
    )
    found = rows[squares.argmax()]
    return tuple(found / np.linalg.norm(found))


def _short(x: float) -> str:
    return f"{round(x, 6) + 0.0:.6g}"
