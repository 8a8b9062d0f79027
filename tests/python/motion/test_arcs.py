# SPDX-License-Identifier: Apache-2.0
"""Arcs of the tool on a UR5e under the virtual clock, compared with circles that NumPy computes from the same three points.

The random arcs vary with the day; a failure names its seed, and `OPENGPAC_ARCS_FROM=seed OPENGPAC_ARCS=1` runs that one again.
"""

from __future__ import annotations

import datetime
import os
import random
from collections.abc import Iterator

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion
from opengpac.motion import ArcRefused, move_circular
from tool_path import places

ON_THE_ARC = 1e-6
"""Maximum distance of a set-point from its circle, m."""
CYCLE_S = 0.02


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields an enabled UR5e at home."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system, made.enabled():
        yield made


def commanded(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the set-points since a time: one row each."""
    columns = [joint.commanded.history[:] for joint in arm]
    return np.array([column["value"][column["time"] > since] for column in columns]).T


def here(arm: gpac.robots.Arm) -> gpac.Pose:
    """Returns the commanded pose of the tool."""
    return arm.forward(arm.values("commanded"))


def away(shift: tuple[float, float, float], start: gpac.Pose, turn: tuple[float, float, float] = (0, 0, 0)) -> gpac.Pose:
    """Returns a pose displaced from another along the world's axes, and turned about its own."""
    return gpac.Pose(shift) @ start @ gpac.Pose(rpy=turn)


class Circle:
    """Circle through three points, whose centre comes from linear equations."""

    def __init__(self, *places: np.ndarray) -> None:
        start, via, goal = (np.asarray(place, dtype=float) for place in places)
        self.normal = np.cross(via - start, goal - start)
        self.normal /= np.linalg.norm(self.normal)
        rows = np.array([via - start, goal - start, self.normal])
        self.centre = np.linalg.solve(rows, [via @ via / 2 - start @ start / 2, goal @ goal / 2 - start @ start / 2, self.normal @ start])
        self.radius = float(np.linalg.norm(start - self.centre))
        self.x = (start - self.centre) / self.radius
        self.y = np.cross(self.normal, self.x)

    def off(self, places: np.ndarray) -> float:
        """Returns the maximum distance of the points from the circle, m."""
        height = (places - self.centre) @ self.normal
        out = np.linalg.norm(places - self.centre - np.outer(height, self.normal), axis=1) - self.radius
        return float(np.hypot(height, out).max())

    def angles(self, places: np.ndarray) -> np.ndarray:
        """Returns the angles of the points from the circle's start, continuing beyond one turn, rad."""
        return np.unwrap(np.arctan2((places - self.centre) @ self.y, (places - self.centre) @ self.x))


def track(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the positions of the tool commanded since a time."""
    return places(arm, commanded(arm, since))


def check_limits(arm: gpac.robots.Arm, since: float) -> None:
    """Checks that no set-point of a joint exceeds its speed or acceleration."""
    speeds = np.diff(commanded(arm, since), axis=0) / CYCLE_S
    assert (np.abs(speeds) <= np.array(arm.values("max_speed")) * (1 + 1e-9)).all()
    assert (np.abs(np.diff(speeds, axis=0)) / CYCLE_S <= np.array(arm.values("max_acceleration")) * 1.02).all()


def test_the_tool_goes_round_on_the_circle_at_the_speed(arm: gpac.robots.Arm) -> None:
    start, since = here(arm), arm.system.now
    via, goal = away((0.05, -0.1, 0.02), start), away((0.1, 0.0, 0.05), start)
    moved = move_circular(arm, via, goal, speed="100 mm/s")
    assert moved.condition == "arrived"
    assert arm.pose().distance(goal) < 1e-4
    places = track(arm, since)
    circle = Circle(start.position, via.position, goal.position)
    assert circle.off(places) < ON_THE_ARC
    assert np.linalg.norm(places - via.position, axis=1).min() < 0.1 * CYCLE_S
    angles = circle.angles(places)
    assert (np.diff(angles) >= -1e-9).all()
    speeds = np.diff(angles) * circle.radius / CYCLE_S
    assert 0.0999 < speeds.max() <= 0.1 * (1 + 1e-6)
    check_limits(arm, since)


@pytest.mark.parametrize(("angle", "turns"), [("360 deg", 1.0), ("720 deg", 2.0), ("90 deg", 0.25)])
def test_an_angle_says_where_it_ends(arm: gpac.robots.Arm, angle: str, turns: float) -> None:
    start, since = here(arm), arm.system.now
    via, goal = away((0.04, -0.04, 0), start), away((0.08, 0, 0), start)
    move_circular(arm, via, goal, angle=angle, orientation="goal")
    circle = Circle(start.position, via.position, goal.position)
    places = track(arm, since)
    assert circle.off(places) < ON_THE_ARC
    assert circle.angles(places)[-1] == pytest.approx(2 * np.pi * turns, abs=1e-5)


def test_the_orientation_is_that_of_the_poses_even_or_kept_to_the_path(arm: gpac.robots.Arm) -> None:
    start = here(arm)
    via, goal = away((0.04, -0.04, 0), start, (0, 0, 0.5)), away((0.08, 0, 0), start, (0, 0, 0.2))
    for orientation, at_via, at_end in (("via", 0.5, 0.2), ("goal", 0.1, 0.2), ("path", np.pi / 2, np.pi)):
        since = arm.system.now
        move_circular(arm, via, goal, orientation=orientation, speed=0.05)
        poses = [arm.forward(q) for q in commanded(arm, since)]
        near = min(poses, key=via.distance)
        assert start.angle(near) == pytest.approx(at_via, abs=0.03)
        assert start.angle(poses[-1]) == pytest.approx(at_end, abs=1e-6)
        check_limits(arm, since)
        motion.move_absolute(arm, arm.inverse(start, near=arm.values("home")))


def test_a_small_circle_is_passed_within_the_acceleration(arm: gpac.robots.Arm) -> None:
    start, since = here(arm), arm.system.now
    via, goal = away((0.002, -0.002, 0), start), away((0.004, 0, 0), start)
    move_circular(arm, via, goal, speed=1.0, acceleration=0.5, angle="720 deg")
    speeds = np.diff(track(arm, since), axis=0) / CYCLE_S
    assert (np.linalg.norm(np.diff(speeds, axis=0), axis=1) / CYCLE_S <= 0.5 * 1.02).all()
    assert np.linalg.norm(speeds, axis=1).max() > 0.7 * np.sqrt(0.5 * 0.002)


def test_poses_on_a_line_are_gone_straight(arm: gpac.robots.Arm) -> None:
    start, since = here(arm), arm.system.now
    goal = away((0.1, -0.05, 0), start)
    move_circular(arm, away((0.04, -0.02, 0), start), goal)
    along = (goal.position - start.position) / start.distance(goal)
    off = track(arm, since) - start.position
    assert np.linalg.norm(off - np.outer(off @ along, along), axis=1).max() < ON_THE_ARC


@pytest.mark.parametrize(
    ("via", "goal", "given", "condition", "words"),
    [
        ((0, 0, 0), (0.1, 0, 0), {}, "no_arc", "'via' is the current pose of the tool"),
        ((0.1, 0, 0), (0.1, 0, 0), {}, "no_arc", "'via' is the goal"),
        ((0.05, 0.05, 0), (0, 0, 0), {"angle": "360 deg"}, "no_arc", "pass another pose on the circle as the goal"),
        ((0.2, 0, 0), (0.1, 0, 0), {}, "no_arc", "'via' is not between the other two"),
        ((-0.05, 1e-4, 0), (0.1, 0, 0), {}, "no_arc", "'via' is not between the other two"),
        ((0.05, 0, 0), (0.1, 0, 0), {"angle": 1.0}, "no_arc", "a straight line, which has no angle"),
        ((0.05, 0.05, 0), (0.1, 0, 0), {"angle": "30 deg"}, "no_arc", "the angle ends before 'via'"),
        ((1, -1, 0), (2, 0, 0), {}, "unreachable", "a point of the arc is .* m out of reach"),
    ],
)
def test_poses_that_make_no_arc_are_refused_in_words(
    arm: gpac.robots.Arm, via: tuple[float, ...], goal: tuple[float, ...], given: dict[str, object], condition: str, words: str
) -> None:
    before, start = arm.values("commanded"), here(arm)
    with pytest.raises(ArcRefused, match=words) as refused:
        move_circular(arm, gpac.Pose(via) @ start, gpac.Pose(goal) @ start, **given)  # type: ignore[arg-type]
    assert refused.value.condition == condition
    arm.system.advance("0.1 s")
    assert arm.values("commanded") == before
    with pytest.raises(gpac.CallError, match="must be 'via', 'goal' or 'path'"):
        move_circular(arm, start, start, orientation="tool")  # type: ignore[arg-type]


def test_the_joint_whose_range_ends_on_an_arc_is_named(arm: gpac.robots.Arm) -> None:
    start = here(arm)
    arm.elbow.position_max = arm.elbow.commanded.value + 0.01
    with pytest.raises(ArcRefused, match=r"joint 'elbow' would leave its range") as refused:
        move_circular(arm, away((0.08, 0, -0.08), start), away((0.16, 0, 0), start))
    assert (refused.value.joint, refused.value.condition) == ("elbow", "limit")


def test_an_arm_that_moves_is_braked_before_its_arc() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system, arm.enabled():
        since = arm.system.now
        moving = motion.move_velocity.asynch(arm, [0, 0, 0, 0.3, 0, 0])
        arm.system.advance("0.5 s")
        start = here(arm)
        moved = move_circular(arm, away((0.05, -0.05, 0), start), away((0.1, 0, 0), start))
        assert moved.condition == "arrived"
        assert moving.state == "ended"
        check_limits(arm, since)


def disturbed(arm: gpac.robots.Arm, seed: int) -> bool:
    """Follows a random arc with halts, overrides and pauses at random instants; returns false if the arm cannot follow it."""
    chance = random.Random(seed)
    start = here(arm)
    shift = lambda most: tuple(chance.uniform(-most, most) for _ in range(3))  # noqa: E731
    via, goal = away(shift(0.1), start, shift(0.2)), away(shift(0.1), start, shift(0.2))
    given = {"orientation": chance.choice(("via", "goal", "path")), "speed": chance.uniform(0.02, 0.4)}
    if chance.random() < 0.3:
        given |= {"angle": chance.uniform(1.0, 9.0), "orientation": "goal"}
    since, most, is_halted = arm.system.now, given["speed"], False
    moving = move_circular.asynch(arm, via, goal, **given)
    for _ in range(chance.randrange(12)):
        if moving.report is not None:
            break
        what = chance.choice(("override", "cell", "pause", "halt", "go on"))
        if what == "override":
            arm.override = chance.choice((0.0, 0.1, chance.random(), 1.0))
        elif what == "cell":
            arm.system.override = chance.choice((chance.random(), 1.0))
        elif what == "pause":
            moving.suspend()
            arm.system.advance(chance.uniform(0.0, 0.3))
            moving.resume()
        elif what == "halt" and chance.random() < 0.5:
            moving.halt()
            is_halted = True
            break
        arm.system.advance(chance.uniform(0.0, 0.4))
    arm.override = arm.system.override = 1.0
    try:
        moved = moving.wait()
    except ArcRefused:
        return False
    except gpac.InvalidState:
        # A halt has already waited for its end.
        moved = None
    places = track(arm, since)
    circle = Circle(start.position, via.position, goal.position)
    assert circle.off(places) < ON_THE_ARC, seed
    if len(places) > 2:
        angles = circle.angles(places)
        # A servo at rest keeps its set-points only to within their last digits.
        assert (np.diff(angles) * circle.radius >= -2e-7).all(), seed
        assert (np.linalg.norm(np.diff(places, axis=0), axis=1) <= most * CYCLE_S * (1 + 1e-6)).all(), seed
    check_limits(arm, since)
    assert is_halted or moved is not None, seed
    if moved is not None and moved.condition == "arrived" and "angle" not in given:
        assert np.linalg.norm(places[-1] - goal.position) < ON_THE_ARC, seed
    return True


def test_random_arcs_stay_on_their_circles_whatever_comes_between(arm: gpac.robots.Arm) -> None:
    first = int(os.environ.get("OPENGPAC_ARCS_FROM", datetime.date.today().toordinal() * 1000))
    count, gone = int(os.environ.get("OPENGPAC_ARCS", 24)), 0
    for seed in range(first, first + count):
        motion.move_absolute(arm, arm.values("home"))
        arm.system.advance("0.1 s")
        gone += disturbed(arm, seed)
    assert count < 8 or gone > count / 3, f"{gone} of {count} from {first}"
