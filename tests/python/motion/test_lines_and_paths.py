# SPDX-License-Identifier: Apache-2.0
"""Straight lines of the tool and paths with blends, on a UR5e under the virtual clock, checked at every millisecond."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

import opengpac as gpac
import tool_path
from opengpac.motion import LineRefused, PathRefused, follow, follow_linear, move_linear


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields an enabled UR5e at home."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system, made.enabled():
        yield made


def sensed(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the joint positions of each millisecond since a time: one row each."""
    columns = [joint.sensed.history[:] for joint in arm]
    return np.array([column["value"][column["time"] > since] for column in columns]).T


def commanded(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the set-points since a time: one row each."""
    columns = [joint.commanded.history[:] for joint in arm]
    return np.array([column["value"][column["time"] > since] for column in columns]).T


def off_the_line(points: np.ndarray, start: np.ndarray, goal: np.ndarray) -> float:
    """Returns the maximum distance of the points from a straight line."""
    along = (goal - start) / np.linalg.norm(goal - start)
    away = (points - start) - np.outer((points - start) @ along, along)
    return float(np.linalg.norm(away, axis=1).max())


def check_speeds(arm: gpac.robots.Arm, since: float) -> None:
    """Checks that no joint exceeds its limit in any millisecond, nor any step of a set-point."""
    speeds = np.array(arm.values("max_speed"))
    assert (np.abs(np.diff(sensed(arm, since), axis=0)) <= speeds * 1e-3 * 1.05).all()
    assert (np.abs(np.diff(commanded(arm, since), axis=0)) <= speeds * 0.02 * (1 + 1e-9)).all()


def test_the_tool_goes_straight_and_turns_evenly(arm: gpac.robots.Arm) -> None:
    start, since = arm.pose(), arm.system.now
    goal = gpac.Pose((0.15, -0.2, -0.15)) @ start @ gpac.Pose(rpy=(0.3, 0.1, 0.4))
    moved = move_linear(arm, goal, speed=0.2)
    assert arm.pose().distance(goal) < 1e-4
    assert arm.pose().angle(goal) < 1e-3
    # Textbook duration of such a motion; the turn and the joints may require a little more.
    least = start.distance(goal) / 0.2 + 0.2 / 1.0 + 1.0 / 10.0
    assert least <= moved.duration < least * 1.05
    poses = [arm.forward(q) for q in sensed(arm, since)[::5]]
    places = np.array([pose.position for pose in poses])
    assert off_the_line(places, start.position, goal.position) < 1e-3
    assert (np.linalg.norm(np.diff(places, axis=0), axis=1) <= 0.2 * 5e-3 * 1.05).all()
    for pose in poses[::10]:
        done = start.distance(pose) / start.distance(goal)
        assert start.angle(pose) == pytest.approx(start.angle(goal) * done, abs=5e-3)
    check_speeds(arm, since)


def test_a_turn_in_place_and_a_line_of_no_length(arm: gpac.robots.Arm) -> None:
    start, since = arm.pose(), arm.system.now
    goal = start @ gpac.Pose(rpy=(0, 0, "60 deg"))
    assert move_linear(arm, goal, angular_speed="45 deg/s").duration > 60 / 45
    places = tool_path.places(arm, sensed(arm, since)[::20])
    assert np.linalg.norm(places - start.position, axis=1).max() < 1e-3
    assert arm.pose().angle(goal) < 1e-3
    assert move_linear(arm, goal).duration < 0.2


def test_the_speed_is_what_the_joints_can_do(arm: gpac.robots.Arm) -> None:
    for joint in arm:
        joint.max_speed = 0.2
    since = arm.system.now
    goal = arm.pose() @ gpac.Pose((0.2, 0.1, 0))
    assert move_linear(arm, goal, speed="2 m/s", acceleration=5.0).duration > 0.5
    check_speeds(arm, since)


@pytest.mark.parametrize(
    ("way", "condition"),
    [((2.0, 0, 0), "unreachable"), ((0.98, 0.27, 0), "singular")],
)
def test_a_line_that_cannot_be_gone_moves_nothing(arm: gpac.robots.Arm, way: tuple[float, ...], condition: str) -> None:
    before, start = arm.values("commanded"), arm.pose()
    goal = gpac.Pose(way) @ start
    with pytest.raises(LineRefused) as refused:
        move_linear(arm, goal)
    assert refused.value.condition == condition
    assert isinstance(refused.value, gpac.Unreachable)
    arm.system.advance("0.1 s")
    assert arm.values("commanded") == before


def test_the_joint_whose_range_ends_is_named(arm: gpac.robots.Arm) -> None:
    arm.elbow.position_max = 1.6
    before, start = arm.values("commanded"), arm.pose()
    with pytest.raises(LineRefused, match=r"joint 'elbow' would leave its range, -3\.14159 to 1\.6") as refused:
        move_linear(arm, gpac.Pose((0.25, 0, -0.25)) @ start)
    assert (refused.value.joint, refused.value.condition) == ("elbow", "limit")
    assert arm.values("commanded") == before


def test_tool_and_base_are_taken_at_each_start(arm: gpac.robots.Arm) -> None:
    arm.base = gpac.Pose((1, 0, 0), rpy=(0, 0, "90 deg"))
    arm.tool = gpac.Pose((0, 0, "150 mm"), rpy=("20 deg", 0, 0))
    start = arm.pose()
    instance = move_linear.new_instance(arm)
    goal = start @ gpac.Pose(rpy=(0, "25 deg", 0))
    instance.start(goal)
    instance.wait()
    assert arm.pose().distance(goal) < 1e-4
    assert arm.pose().angle(goal) < 1e-3
    arm.tool = gpac.Pose()
    goal = arm.pose() @ gpac.Pose((0.05, 0, 0))
    instance.start(goal, speed=0.1)
    instance.wait()
    assert arm.pose().distance(goal) < 1e-4
    instance.delete()


def test_a_suspended_line_stands_still_and_goes_on_straight(arm: gpac.robots.Arm) -> None:
    start, since = arm.pose(), arm.system.now
    goal = gpac.Pose((0.1, -0.2, 0)) @ start
    moving = move_linear.asynch(arm, goal, speed=0.1)
    arm.system.advance("0.8 s")
    moving.suspend()
    arm.system.advance("0.3 s")
    place = arm.pose()
    arm.system.advance("1 s")
    assert arm.pose().distance(place) < 1e-4
    moving.resume()
    moving.wait()
    assert arm.pose().distance(goal) < 1e-4
    places = tool_path.places(arm, sensed(arm, since)[::10])
    assert off_the_line(places, start.position, goal.position) < 1e-3
    check_speeds(arm, since)


def test_the_tool_follows_poses_within_the_blend(arm: gpac.robots.Arm) -> None:
    start, since = arm.pose(), arm.system.now
    shifts = [(0.1, 0, 0), (0.1, -0.2, 0), (0.1, -0.2, -0.15), (0, 0, 0)]
    poses = [gpac.Pose(shift) @ start @ gpac.Pose(rpy=(0, 0, turn)) for shift, turn in zip(shifts, (0, 0.4, 0.4, 0), strict=True)]
    smooth = follow_linear(arm, poses, blend=0.015, speed=0.2)
    places = tool_path.places(arm, sensed(arm, since)[::5])
    for pose in poses:
        assert np.linalg.norm(places - pose.position, axis=1).min() < 0.016
    corners = [start, *poses]
    away = [
        min(off_the_line(place[None], one.position, other.position) for one, other in itertools.pairwise(corners)) for place in places[::10]
    ]
    assert max(away) < 0.016
    assert (np.linalg.norm(np.diff(places, axis=0), axis=1) <= 0.2 * 5e-3 * 1.05).all()
    assert arm.pose().distance(start) < 1e-4
    assert arm.pose().angle(start) < 1e-3
    check_speeds(arm, since)
    assert smooth.duration < follow_linear(arm, poses, blend=0, speed=0.2).duration - 0.2


def test_of_several_poses_the_one_that_cannot_be_had_is_named(arm: gpac.robots.Arm) -> None:
    before, start = arm.values("commanded"), arm.pose()
    with pytest.raises(LineRefused, match=r"on the way to pose 1: the goal is .* m out of reach") as refused:
        follow_linear(arm, [gpac.Pose((0.1, 0, 0)) @ start, gpac.Pose((2, 0, 0)) @ start])
    assert refused.value.point == 1
    arm.system.advance("0.1 s")
    assert arm.values("commanded") == before
    with pytest.raises(gpac.CallError, match="pass a list of poses"):
        follow_linear(arm, start)  # type: ignore[arg-type]


def test_a_path_passes_its_points_within_the_blend_and_ends_exactly(arm: gpac.robots.Arm) -> None:
    start, since = np.array(arm.values("sensed")), arm.system.now
    points = start + np.array([[0.4, 0, 0, 0, 0, 0], [0.4, -0.4, 0.3, 0, 0, 0], [0.1, -0.4, 0.3, 0.2, 0.4, 1.0], [0, 0, 0, 0, 0, 0]])
    moved = follow(arm, points, blend=0.04, speed=0.8)
    track = sensed(arm, since)
    for point in points:
        assert np.abs(track - point).max(axis=1).min() < 0.045
    assert [joint.commanded.value for joint in arm] == points[-1].tolist()
    check_speeds(arm, since)
    speed = np.diff(commanded(arm, since), axis=0) / 0.02
    acceleration = np.diff(speed, axis=0) / 0.02
    assert (np.abs(speed) <= 0.8 * (1 + 1e-6)).all()
    assert (np.abs(acceleration) <= np.array(arm.values("max_acceleration")) * 1.01).all()
    assert moved.duration < follow(arm, points, blend=0, speed=0.8).duration - 0.3


def test_speed_and_blend_may_differ_from_point_to_point(arm: gpac.robots.Arm) -> None:
    start, since = np.array(arm.values("sensed")), arm.system.now
    points = start + np.array([[0.2, 0, 0, 0, 0, 0], [0.2, -0.2, 0, 0, 0, 0]])
    follow(arm, points.tolist(), blend=[0, 0], speed=[0.1, 0.5])
    speeds = np.abs(np.diff(commanded(arm, since), axis=0)) / 0.02
    assert speeds[:, 0].max() == pytest.approx(0.1, rel=1e-3)
    assert speeds[:, 1].max() == pytest.approx(0.5, rel=1e-2)


def test_a_path_out_of_range_names_the_point_and_the_joint(arm: gpac.robots.Arm) -> None:
    before = arm.values("commanded")
    with pytest.raises(
        PathRefused, match=r"waypoint 1 is outside the range of joint 'shoulder_lift'.*if the points are in degrees"
    ) as refused:
        follow(arm, [before, [0, -90, 90, -90, -90, 0]])
    assert (refused.value.joint, refused.value.point) == ("shoulder_lift", 1)
    arm.system.advance("0.1 s")
    assert arm.values("commanded") == before


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"points": [[0, 0]]}, "shape"),
        ({"points": []}, "shape"),
        ({"points": 5}, "waypoints must be a list of joint positions, not 5"),
        ({"points": [[0] * 6] * 4097}, "4097 waypoints"),
        ({"points": [["a"] * 6]}, "waypoints must be"),
        ({"points": [[0] * 6], "blend": []}, "0 values"),
    ],
)
def test_points_of_the_wrong_form_are_refused_at_the_call(arm: gpac.robots.Arm, given: dict[str, object], message: str) -> None:
    with pytest.raises(gpac.CallError, match=message) as refused:
        follow(arm, **given)  # type: ignore[arg-type]
    assert refused.value.file == __file__


def test_a_group_without_geometry_is_told_what_it_lacks(arm: gpac.robots.Arm) -> None:
    part = gpac.Group("part", *arm)
    with pytest.raises(gpac.CallError, match=r"'chain' is missing, and group part.* has no 'chain' to use instead"):
        move_linear(part, arm.pose())
    with pytest.raises(gpac.OutOfRange, match="'pose' has the quaternion 0, 0, 0, 0, whose length is 0; give one of length 1"):
        move_linear(arm, [0, 0, 0, 0, 0, 0, 0])


@pytest.mark.parametrize("how", ["halt", "time_limit"])
@pytest.mark.parametrize("verb", ["move_linear", "follow_linear", "follow"])
def test_a_halt_and_a_time_limit_bring_it_to_rest_on_its_way(arm: gpac.robots.Arm, verb: str, how: str) -> None:
    start, since = arm.pose(), arm.system.now
    goal = gpac.Pose((0.1, -0.2, 0)) @ start
    away = [*np.array(arm.values("sensed")) + 0.5]
    calls = {"move_linear": (move_linear, goal), "follow_linear": (follow_linear, [goal]), "follow": (follow, [away])}
    called, argument = calls[verb]
    if how == "halt":
        moving = called.asynch(arm, argument)
        arm.system.advance("0.5 s")
        moving.halt()
        assert moving.report is not None
        assert moving.report.condition in ("halted", "stopped")
    else:
        with pytest.raises(gpac.robots.MotionTimeout):
            called(arm, argument, time_limit="0.5 s")
    arm.system.advance("0.2 s")
    assert start.distance(arm.pose()) > 0.02
    if verb == "follow":
        assert np.abs(np.array(arm.values("sensed")) - away).min() > 0.1
    else:
        assert start.distance(arm.pose()) < start.distance(goal) - 0.02
        places = tool_path.places(arm, sensed(arm, since)[::10])
        assert off_the_line(places, start.position, goal.position) < 1e-3
    speeds = np.diff(commanded(arm, since), axis=0) / 0.02
    assert np.abs(speeds[-1]).max() < 0.15
    limits = np.array(arm.values("max_acceleration"))
    assert (np.abs(np.diff(speeds, axis=0)) / 0.02 <= limits * 1.02).all()


def test_lines_and_paths_can_be_composed(arm: gpac.robots.Arm) -> None:
    parts = {"move_linear": move_linear, "follow": follow}
    steps = {("move_linear", "arrived"): "follow"}
    both = gpac.compose("both", parts, transitions=steps, initial="move_linear", rename={"follow.speed": "joint_speed"})
    home = np.array(arm.values("sensed"))
    both(arm, pose=gpac.Pose((0, 0, 0.05)) @ arm.pose(), points=[home, home + 0.1])
    assert np.abs(np.array(arm.values("sensed")) - home - 0.1).max() < 0.002
