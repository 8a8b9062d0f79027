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
"""Frame name of points that are joint positions."""

WORLD = "world"
"""Name of the frame of the arm's poses."""


@dataclass(frozen=True)
class PointEntry:
    """Entry of a point in its file: joints in rad or m, and for a point in space the pose in its frame."""

    joints: dict[str, float]
    frame: str = JOINTS
    tool: str | None = None
    pose: Pose | None = None
    configuration: Configuration | None = None
    note: str = ""
    taught: datetime | None = None


class Point(Mapping[str, float]):
    """A taught point: joint → rad (m for a sliding joint). A goal of a motion: `move(arm, goal=points["pick"])`.

    Made by `points["pick"]` and `points.teach("pick")`; `name` is its name in the file. `frame` is `joints`, or for a point in space
    `world` or the name of a work frame; the joints of a point in space are computed on access from its pose, with the present frame
    and tool and its configuration. `note` is for people, `taught` is the time at which it was taught, or None.
    """

    def __init__(self, name: str, entry: PointEntry, reach: Callable[[], tuple[dict[str, float], Pose]] | None = None) -> None:
        self.name, self.frame, self.tool, self.note, self.taught = name, entry.frame, entry.tool, entry.note, entry.taught
        self.configuration = entry.configuration
        """Configuration of the arm for a point in space, if the arm has configurations; else None."""
        self._entry, self._reach = entry, reach
        self._reached: tuple[dict[str, float], Pose] | None = None

    @property
    def in_frame(self) -> Pose | None:
        """Pose of the point's tool in its frame; None for a point that is joint positions."""
        return self._entry.pose

    @property
    def pose(self) -> Pose:
        """Returns `arm.pose()` at the point, with the arm's present tool: a goal of `move_linear`.

        Raises `CallError` for points without an arm, `Unreachable` for a point in space that the arm does not reach.
        """
        if self._reach is None:
            refuse(CallError, f"the pose of point '{self.name}' requires the geometry of its arm", "pass the arm: gpac.Points(path, arm)")
        if self._reached is None:
            self._reached = self._reach()
        return self._reached[1]

    @property
    def taught_joints(self) -> dict[str, float]:
        """Joint positions of the arm when the point was taught, regardless of the present frame and tool."""
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
        """Positions in the arm's order."""
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
