# SPDX-License-Identifier: Apache-2.0
"""A taught point, and what stands of it in its file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from ..errors import CallError, UnknownName, did_you_mean, refuse
from ..values.configurations import Configuration
from ..values.frames import Pose

JOINTS = "joints"
"""The frame of a point that is joint positions."""

WORLD = "world"
"""The frame in which the poses of the arm are given."""


@dataclass(frozen=True)
class PointEntry:
    """A point as its file has it: joints in rad or m, and the pose in its frame of a point in space."""

    joints: dict[str, float]
    frame: str = JOINTS
    tool: str | None = None
    pose: Pose | None = None
    configuration: Configuration | None = None
    note: str = ""
    taught: datetime | None = None


class Point(Mapping[str, float]):
    """A taught point: joint → rad (m for a sliding joint). A goal of a motion: `move(arm, goal=points["pick"])`.

    Made by `points["pick"]` and `points.teach("pick")`; `name` is its own in the file. `frame` is what it is told in: `joints`, or
    `world` or the name of a work frame for a point in space, whose joints are computed when they are asked for, from its pose, with the
    frame and the tool of now and its configuration. `note` is for people, `taught` when it was taught, or None.
    """

    def __init__(self, name: str, entry: PointEntry, reach: Callable[[], tuple[dict[str, float], Pose]] | None = None) -> None:
        self.name, self.frame, self.tool, self.note, self.taught = name, entry.frame, entry.tool, entry.note, entry.taught
        self.configuration = entry.configuration
        """Which of the arm's joint positions are meant, of a point in space of an arm that has configurations; else None."""
        self._entry, self._reach = entry, reach
        self._reached: tuple[dict[str, float], Pose] | None = None

    @property
    def in_frame(self) -> Pose | None:
        """The pose of its tool in its frame; None of a point that is joint positions."""
        return self._entry.pose

    @property
    def pose(self) -> Pose:
        """Where `arm.pose()` is there, with the arm's tool of now: a goal of `move_linear`.

        Raises `CallError` for points without an arm, `Unreachable` for a point in space that the arm does not reach.
        """
        if self._reach is None:
            refuse(CallError, f"the pose of point '{self.name}' needs the geometry of its arm", "give the arm: gpac.Points(path, arm)")
        if self._reached is None:
            self._reached = self._reach()
        return self._reached[1]

    @property
    def taught_joints(self) -> dict[str, float]:
        """The joint positions that the arm had when it was taught, whatever its frame and tool are now."""
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
        """The positions in the arm's order."""
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
