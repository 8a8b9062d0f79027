# SPDX-License-Identifier: Apache-2.0
"""Lists of way-points as the tables of fixed size that the planners take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import library
from ..errors import CallError, refuse
from ..frames import Pose
from ..numerals import number

POINTS_MAX = int(library.path_planner.items["points"].type.split("[")[1].rstrip("]"))
"""The maximum number of way-points of one path: the rows of the planner's table."""

JOINTS_MAX = library.path_planner.items["n"].most
"""The maximum number of joints of one path."""


def way_points(given: Any, objects: Mapping[str, Any]) -> Any:
    """A list of way-points as the planner's table: short lists are filled up with their last point, rows with zeros."""
    try:
        points = np.array([list(point) for point in given], dtype=float)
    except (TypeError, ValueError):
        refuse(CallError, f"the way-points are {given!r}", "give a list of joint positions, each a list of numbers in rad")
    joints = len(objects["arm"]) if "arm" in objects else points.shape[-1]
    if points.ndim != 2 or not 1 <= len(points) <= POINTS_MAX or points.shape[1] != joints or joints > JOINTS_MAX:
        refuse(
            CallError, f"the way-points have the shape {points.shape}", f"give 1 to {POINTS_MAX} points of {joints} joint positions each"
        )
    table = np.zeros((POINTS_MAX, JOINTS_MAX))
    table[: len(points), :joints] = points
    table[len(points) :, :joints] = points[-1]
    return table


def each_point(given: Any, objects: Mapping[str, Any]) -> Any:
    """One value for all way-points, or one for each: filled up with the last."""
    given = number(given)
    if isinstance(given, int | float):
        return [float(given)] * POINTS_MAX
    is_list = isinstance(given, Sequence) and not isinstance(given, str | bytes)
    if not is_list and not (isinstance(given, np.ndarray) and given.ndim == 1):
        refuse(CallError, f"{given!r} is given for the way-points", f"give one number for all, or a list of 1 to {POINTS_MAX}")
    values = list(given)
    if not 1 <= len(values) <= POINTS_MAX:
        refuse(CallError, f"{len(values)} values are given for the way-points", f"give one for all, or 1 to {POINTS_MAX}")
    return values + [values[-1]] * (POINTS_MAX - len(values))


def poses(given: Any, objects: Mapping[str, Any]) -> Any:
    """A list of poses as the planner's table: a short list is filled up with its last."""
    if isinstance(given, Pose | str) or not hasattr(given, "__iter__"):
        refuse(CallError, f"the poses are {given!r}", "give a list of poses; for one there is move_linear")
    found = [list(Pose.of(pose)) for pose in given]
    if not 1 <= len(found) <= POINTS_MAX:
        refuse(CallError, f"{len(found)} poses are given", f"give 1 to {POINTS_MAX}")
    return found + [found[-1]] * (POINTS_MAX - len(found))
