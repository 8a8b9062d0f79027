# SPDX-License-Identifier: Apache-2.0
"""Converts lists of way-points to tables of the fixed size that the planners expect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from .. import library
from ..errors import CallError, refuse
from ..values.frames import Pose
from ..values.numbers import number

Form: TypeAlias = Callable[[Any, Mapping[str, Any]], Any]
"""Function that converts an argument of a call into the value for a port."""

POINTS_MAX = int(library.path_planner.items["points"].type.split("[")[1].rstrip("]"))
"""Maximum number of way-points of one path: the rows of the planner's table."""

LONG_POINTS_MAX = int(library.long_path_planner.items["points"].type.split("[")[1].rstrip("]"))
"""Maximum number of way-points of a long path."""

JOINTS_MAX = library.path_planner.items["n"].most
"""Maximum number of joints of one path."""

_SHORTEN = "leave out points on straight lines between others, or split the motion into parts, each of which ends at rest"


def way_points(given: Any, objects: Mapping[str, Any]) -> np.ndarray:
    """Returns the way-points of `follow` as its planner's table."""
    return _way_points(given, objects, POINTS_MAX, "follow_long")


def long_way_points(given: Any, objects: Mapping[str, Any]) -> np.ndarray:
    """Returns the way-points of `follow_long` as its planner's table."""
    return _way_points(given, objects, LONG_POINTS_MAX)


def poses(given: Any, objects: Mapping[str, Any]) -> list[list[float]]:
    """Returns the poses of `follow_linear` as its planner's table."""
    return _poses(given, POINTS_MAX, "follow_linear_long")


def long_poses(given: Any, objects: Mapping[str, Any]) -> list[list[float]]:
    """Returns the poses of `follow_linear_long` as its planner's table."""
    return _poses(given, LONG_POINTS_MAX)


def each_point(given: Any, objects: Mapping[str, Any]) -> list[float]:
    """Returns one value for each way-point of a path."""
    return _each_point(given, POINTS_MAX)


def each_long_point(given: Any, objects: Mapping[str, Any]) -> list[float]:
    """Returns one value for each way-point of a long path."""
    return _each_point(given, LONG_POINTS_MAX)


def _way_points(given: Any, objects: Mapping[str, Any], most: int, longer: str = "") -> np.ndarray:
    """Returns way-points as a table of `most` rows. Short lists are padded with their last point, and short rows with zeros.

    `longer` names the verb that accepts longer lists.
    """
    try:
        points = np.array([list(point) for point in given], dtype=float)
    except (TypeError, ValueError):
        refuse(CallError, f"the waypoints must be a list of joint positions, not {_shown(given)}", "pass a list of lists of numbers in rad")
    joints = len(objects["arm"]) if "arm" in objects else points.shape[-1]
    if points.ndim != 2 or len(points) < 1 or points.shape[1] != joints or joints > JOINTS_MAX:
        remedy = f"pass 1 to {most} points with {joints} joint positions each"
        refuse(CallError, f"the waypoints have the wrong shape, {points.shape}", remedy)
    _count(len(points), "waypoints", most, longer)
    bad = np.argwhere(~np.isfinite(points))
    if len(bad):
        point, joint = bad[0]
        what = f"position {joint} of waypoint {point} must be finite, not {points[point, joint]} (counted from 0)"
        refuse(CallError, what, "check how the plan was computed")
    table = np.zeros((most, JOINTS_MAX))
    table[: len(points), :joints] = points
    table[len(points) :, :joints] = points[-1]
    return table


def _each_point(given: Any, most: int) -> list[float]:
    """Returns a list of `most` values, given one value for all way-points or one for each, padded with the last value."""
    given = number(given)
    if isinstance(given, int | float):
        return [float(given)] * most
    is_list = isinstance(given, Sequence) and not isinstance(given, str | bytes)
    if not is_list and not (isinstance(given, np.ndarray) and given.ndim == 1):
        refuse(CallError, f"a value for the waypoints cannot be {given!r}", f"pass one number for all, or a list of 1 to {most}")
    values: list[Any] = list(given)
    if not 1 <= len(values) <= most:
        refuse(CallError, f"waypoints cannot have {len(values)} values", f"pass one for all, or 1 to {most}")
    return values + [values[-1]] * (most - len(values))


def _poses(given: Any, most: int, longer: str = "") -> list[list[float]]:
    """Returns poses as a list of length `most`, padded with the last pose. `longer` is as in `_way_points`."""
    if isinstance(given, Pose | str) or not hasattr(given, "__iter__"):
        refuse(CallError, f"the poses must be a list, not {_shown(given)}", "pass a list of poses, or use move_linear for a single one")
    found = [list(Pose.of(pose)) for pose in given]
    if not found:
        refuse(CallError, "the list of poses is empty", f"pass 1 to {most}")
    _count(len(found), "poses", most, longer)
    return found + [found[-1]] * (most - len(found))


def _shown(given: Any) -> str:
    """Formats a value on one line."""
    text = repr(given)
    return text if len(text) <= 200 else f"{text[:200]}…"


def _count(count: int, what: str, most: int, longer: str) -> None:
    """Refuses lists that are longer than the table."""
    if count <= most:
        return
    if longer and count <= LONG_POINTS_MAX:
        refuse(
            CallError,
            f"{count} {what} are too many",
            f"pass 1 to {most} here, or use motion.{longer}, which accepts up to {LONG_POINTS_MAX}",
        )
    refuse(CallError, f"{count} {what} are too many: a path has at most {LONG_POINTS_MAX}", _SHORTEN)


def speeds(points: Sequence[Sequence[float]] | np.ndarray, times: Sequence[float] | np.ndarray) -> list[float]:
    """Converts a planner's times at way-points to speeds of the fastest joint, for `follow(…, speed=…)`.

    points: rows of joint positions, rad; times: one for each, s, ascending. The result has a speed for the path to each point, rad/s.
    `follow` reaches these speeds if the limits of the joints allow it; it does not wait at repeated points.
    """
    q, t = np.asarray(points, dtype=float), np.asarray(times, dtype=float)
    if q.ndim != 2 or t.shape != q.shape[:1] or len(t) < 2:
        refuse(
            CallError, f"waypoints of shape {q.shape} do not match times of shape {t.shape}", "pass one time for each of 2 or more points"
        )
    if not (np.isfinite(q).all() and np.isfinite(t).all()):
        refuse(CallError, "the waypoints or their times contain a number that is not finite", "check how the plan was computed")
    spans = np.diff(t)
    if (late := np.flatnonzero(spans <= 0)).size:
        k = int(late[0])
        what = f"the time of waypoint {k + 1}, {t[k + 1]:.6g} s, is not after that of waypoint {k}, {t[k]:.6g} s"
        refuse(CallError, what, "make the times strictly ascending, and omit points that repeat the previous one")
    found = np.abs(np.diff(q, axis=0)).max(axis=1) / spans
    # A repeated point counts once: any speed is valid for it.
    found[found == 0] = found.max() or 1.0
    return [float(found[0]), *map(float, found)]
