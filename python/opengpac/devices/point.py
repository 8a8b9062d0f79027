# SPDX-License-Identifier: Apache-2.0
"""A taught point, and its entry in the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from ..errors import CallError, UnknownName, did_you_mean, refuse
from ..values.configurations import Configuration
from ..values.frames import Pose

JOINTS = "joints"
"""Frame name of points that are stored as joint positions."""

WORLD = "world"
"""Name of the frame in which the arm's poses are expressed."""


@dataclass(frozen=True)
class PointEntry:
    """Entry of a point in its file: joints in rad or m, and, for a point in space, the pose in its frame."""

    joints: dict[str, float]
    frame: str = JOINTS
    tool: str | None = None
    pose: Pose | None = None
    configuration: Configuration | None = None
    note: str = ""
    taught: datetime | None = None


class Point(Mapping[str, float]):
    """A taught point: joint → rad (m for a prismatic joint). It can be passed as the goal of a motion: `move(arm, goal=points["pick"])`.

    Returned by `points["pick"]` and `points.teach("pick")`. `name` is its name in the file. `frame` is `joints` for joint positions;
    for a point in space it is `world` or the name of a work frame. The joints of a point in space are computed on access, from its
    pose and configuration, using the current frame and tool. `note` is a free-text comment; `taught` is the time at which the point
    was taught, or None.
    """

    def __init__(self, name: str, entry: PointEntry, reach: Callable[[], tuple[dict[str, float], Pose]] | None = None) -> None:
        self.name, self.frame, self.tool, self.note, self.taught = name, entry.frame, entry.tool, entry.note, entry.taught
        self.configuration = entry.configuration
        """Configuration of the arm for a point in space; None for joint positions, and for arms without configurations."""
        self._entry, self._reach = entry, reach
        self._reached: tuple[dict[str, float], Pose] | None = None

    @property
    def in_frame(self) -> Pose | None:
        """Pose of the tool in the frame of the point; None for a point that is stored as joint positions."""
        return self._entry.pose

    @property
    def pose(self) -> Pose:
        """Returns the value of `arm.pose()` at the point, with the arm's current tool, for use as a goal of `move_linear`.

        Raises `CallError` for points without an arm, `Unreachable` for a point in space that the arm cannot reach.
        """
        if self._reach is None:
            refuse(CallError, f"the pose of point '{self.name}' requires the geometry of its arm", "pass the arm: gpac.Points(path, arm)")
        if self._reached is None:
            self._reached = self._reach()
        return self._reached[1]

    @property
    def taught_joints(self) -> dict[str, float]:
        """Joint positions of the arm when the point was taught, regardless of the current frame and tool."""
        return dict(self._entry.joints)

    @property
    def _joints(self) -> dict[str, float]:
        if self._entry.pose is None:
            return self._entry.joints
        _ = self.pose
        assert self._reached is not None
        return self._reached[0]

    @property
    def array(self) -> np.ndarray:
        """Joint positions as an array, in the arm's order."""
        return np.array([*self._joints.values()])

    def __getitem__(self, joint: str) -> float:
        if joint not in self._entry.joints:
            refuse(UnknownName, f"point '{self.name}' has no joint '{joint}'", did_you_mean(str(joint), self._entry.joints))
        return self._joints[joint]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entry.joints)

    def __len__(self) -> int:
        return len(self._entry.joints)

    def __repr__(self) -> str:
        joints = ", ".join(f"{joint} {value:.4g}" for joint, value in self._entry.joints.items())
        entry = self._entry
        place = joints if entry.pose is None else f"{entry.pose!r} in '{entry.frame}'{f' of {entry.tool!r}' if entry.tool else ''}"
        return f"point {self.name}: {place}{f' ({self.note})' if self.note else ''}"
