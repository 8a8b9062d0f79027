# SPDX-License-Identifier: Apache-2.0
"""Paths of thousands of way-points, as a planner outputs, on a UR5e under the virtual clock: limits, halt, take-over, refusals."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
import tool_path
from opengpac import activate, library, on
from opengpac.motion import follow, follow_linear, follow_long, move_absolute, speeds

PERIOD_S = 0.02


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields an enabled UR5e at home."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system, made.enabled():
        yield made


def smooth(start: np.ndarray, seed: int, count: int) -> np.ndarray:
    """Returns a random smooth path from the present joint positions: one row for each point."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0, 1, count)[:, None]
    shape = (3, len(start))
    sizes, rates, phases = rng.uniform(-0.2, 0.2, shape), rng.uniform(2, 15, shape), rng.uniform(0, 6, shape)
    waves = sum(size * (np.sin(rate * s + phase) - np.sin(phase)) for size, rate, phase in zip(sizes, rates, phases, strict=True))
    return start + waves


def commanded(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the set-points since a time: one row each."""
    columns = [joint.commanded.history[:] for joint in arm]
    return np.array([column["value"][column["time"] > since] for column in columns]).T


def check_limits(arm: gpac.robots.Arm, setpoints: np.ndarray) -> None:
    """Checks that speed and acceleration of the set-points are within the joints' limits."""
    speed = np.diff(setpoints, axis=0) / PERIOD_S
    assert (np.abs(speed) <= np.array(arm.values("max_speed")) * (1 + 1e-9)).all()
    acceleration = np.diff(speed, axis=0) / PERIOD_S
    assert (np.abs(acceleration) <= np.array(arm.values("max_acceleration")) * 1.02 + 1e-6).all()


def off_the_way(setpoints: np.ndarray, points: np.ndarray) -> float:
    """Returns the maximum distance of the set-points from the way-points' line, in the worst joint."""
    begins, along = points[:-1], np.diff(points, axis=0)
    squares = np.maximum((along**2).sum(axis=1), 1e-30)
    worst = 0.0
    for q in setpoints:
        share = np.clip(((q - begins) * along).sum(axis=1) / squares, 0, 1)
        worst = max(worst, float(np.abs(q - begins - share[:, None] * along).max(axis=1).min()))
    return worst


@pytest.mark.parametrize("seed", [1, 2])
def test_4096_points_of_a_smooth_way_are_followed_within_the_limits(arm: gpac.robots.Arm, seed: int) -> None:
    points, since = smooth(np.array(arm.values("commanded")), seed, 4096), arm.system.now
    moved = follow(arm, points, speed=1.0, blend=0.001)
    assert (moved.condition, moved.verb) == ("arrived", "follow_long")
    assert np.allclose(arm.values("commanded"), points[-1], atol=0)
    setpoints = commanded(arm, since)
    check_limits(arm, np.vstack([points[0], setpoints]))
    assert off_the_way(setpoints[::5], points) < 1e-4
    # In the middle of the path it moves at full speed: no stops, no creeping from point to point.
    length = np.abs(np.diff(points, axis=0)).max(axis=1).sum()
    assert moved.duration < 3 * length


def test_65_points_go_where_64_go(arm: gpac.robots.Arm) -> None:
    start = np.array(arm.values("commanded"))
    points = smooth(start, 3, 64)
    moved = []
    for extra in ([], [points[-1]]):
        move_absolute(arm, start)
        moved.append(follow(arm, [*points, *extra], blend=0.0, speed=0.5))
    assert [m.verb for m in moved] == ["follow", "follow_long"]
    # With a stop at each point both plans are the same.
    assert moved[0].duration == pytest.approx(moved[1].duration, rel=1e-9)


def test_a_halt_in_the_middle_stays_on_the_way_and_within_the_limits(arm: gpac.robots.Arm) -> None:
    home = np.array(arm.values("commanded"))
    points = smooth(home, 4, 3000)
    since = arm.system.now
    going = follow.asynch(arm, points, speed=0.8, blend=0.001)
    arm.system.advance("2 s")
    going.halt()
    assert going.wait().condition == "halted"
    halted = commanded(arm, since)
    check_limits(arm, np.vstack([home, halted]))
    assert off_the_way(halted[::5], points) < 1e-4
    arm.system.advance("40 ms")
    assert not np.any(arm.values("commanded_velocity"))


def test_one_long_path_takes_over_from_another_within_the_limits() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system, arm.enabled():
        home = np.array(arm.values("commanded"))
        points, other = smooth(home, 4, 3000), smooth(home, 5, 500)
        first = follow.asynch(arm, points, speed=0.8, blend=0.001)
        arm.system.advance("2 s")
        second = follow.asynch(arm, other, speed=0.8, blend=0.001)
        assert second.wait().condition == "arrived"
        assert first.done
        check_limits(arm, np.vstack([home, commanded(arm, 0.0)]))
        assert np.allclose(arm.values("commanded"), other[-1], atol=0)


def test_a_halt_while_the_path_is_planned_leaves_the_arm_where_it_is(arm: gpac.robots.Arm) -> None:
    home = arm.values("commanded")
    points = smooth(np.array(home), 6, 4096)
    going = follow.asynch(arm, points)
    arm.system.advance("30 ms")
    going.halt()
    assert going.wait().condition == "halted"
    assert arm.values("commanded") == home


def test_override_and_suspension_slow_a_long_path_on_its_way(arm: gpac.robots.Arm) -> None:
    home = np.array(arm.values("commanded"))
    points, since = smooth(home, 7, 2000), arm.system.now
    going = follow.asynch(arm, points, speed=0.8, blend=0.001)
    for override in (0.3, 0.0, 1.0, 0.5):
        arm.system.advance("700 ms")
        arm.override = override
    going.suspend()
    arm.system.advance("500 ms")
    going.resume()
    arm.override = 1.0
    assert going.wait().condition == "arrived"
    setpoints = commanded(arm, since)
    check_limits(arm, np.vstack([home, setpoints]))
    assert off_the_way(setpoints[::10], points) < 1e-4


def test_a_long_path_of_the_tool_passes_its_poses(arm: gpac.robots.Arm) -> None:
    start, since = arm.pose(), arm.system.now
    angles = np.linspace(0, 4 * np.pi, 300)
    poses = [gpac.Pose((0.1 * (np.cos(a) - 1), 0.1 * np.sin(a), 0.0)) @ start for a in angles]
    moved = follow_linear(arm, poses, blend=0.001, speed=0.2)
    assert (moved.condition, moved.verb) == ("arrived", "follow_linear_long")
    setpoints = commanded(arm, since)
    check_limits(arm, setpoints)
    places = tool_path.places(arm, setpoints[::5]) - np.array(start.position)
    radius = np.hypot(places[:, 0] + 0.1, places[:, 1])
    assert np.abs(radius - 0.1).max() < 2e-4
    assert np.abs(places[:, 2]).max() < 1e-4


def test_a_pose_out_of_reach_among_many_is_named(arm: gpac.robots.Arm) -> None:
    start, before = arm.pose(), arm.values("commanded")
    poses = [gpac.Pose((0.0005 * k, 0, 0)) @ start for k in range(150)]
    with pytest.raises(gpac.motion.LineRefused, match="on the way to pose 100: the goal is") as refused:
        follow_linear(arm, [*poses[:100], gpac.Pose((3, 0, 0)) @ start, *poses[100:]])
    assert refused.value.point == 100
    assert arm.values("commanded") == before
    with pytest.raises(gpac.motion.PathRefused, match="waypoint 70 is outside the range of joint 'elbow'"):
        follow(arm, [before] * 70 + [[0, 0, 90, 0, 0, 0]])


def test_points_that_are_one_count_once(arm: gpac.robots.Arm) -> None:
    here = arm.values("commanded")
    moved = follow(arm, [here] * 4096)
    assert (moved.condition, moved.duration) == ("arrived", 0.0)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((4097, 6)), r"4097 waypoints are too many: a path has at most 4096; leave out points on straight lines"),
        (np.full((100, 6), np.nan), r"position 0 of waypoint 0 must be finite, not nan"),
        (np.zeros((100, 5)), r"the waypoints have the wrong shape, \(100, 5\); pass 1 to 4096 points with 6"),
    ],
)
def test_what_is_no_plan_is_refused_in_plain_words(arm: gpac.robots.Arm, points: np.ndarray, message: str) -> None:
    with pytest.raises(gpac.CallError, match=message):
        follow(arm, points)


def test_too_many_poses_are_refused(arm: gpac.robots.Arm) -> None:
    with pytest.raises(gpac.CallError, match="4097 poses are too many: a path has at most 4096"):
        follow_linear(arm, [arm.pose()] * 4097)


def test_an_instance_and_a_composition_take_long_paths_by_their_own_verb(arm: gpac.robots.Arm) -> None:
    points = smooth(np.array(arm.values("commanded")), 8, 100)
    with (
        follow.new_instance(arm) as short,
        pytest.raises(gpac.CallError, match=r"pass 1 to 64 here, or use motion\.follow_long, which accepts up to 4096"),
    ):
        short.start(points)
    with follow_long.new_instance(arm) as long:
        assert long.start(points).wait().condition == "arrived"
        assert long.start(points[::-1]).wait().condition == "arrived"
    parts = {"there": follow_long, "back": move_absolute}
    renamed = {"back.*": "back_*", "back.arm": "arm"}
    there_and_back = gpac.compose("there_and_back", parts, transitions={("there", "arrived"): "back"}, rename=renamed)
    there_and_back(arm, points=points, back_goal=points[0])
    assert np.allclose(arm.values("commanded"), points[0], atol=0)


def test_a_named_and_placed_verb_stays_so_with_many_points(arm: gpac.robots.Arm) -> None:
    points = smooth(np.array(arm.values("commanded")), 9, 70)
    assert follow.named("polish")(arm, points).instance == "polish"

    class Polished(gpac.Terminated):
        """It is."""

    with pytest.raises(Polished):
        follow.raising(Polished)(arm, points[::-1])


def test_the_speeds_of_a_plan_with_times(arm: gpac.robots.Arm) -> None:
    start = np.array(arm.values("commanded"))
    points = smooth(start, 10, 1000)
    length = np.abs(np.diff(points, axis=0)).max(axis=1)
    times = np.concatenate([[0.0], np.cumsum(length / 0.3)])
    assert speeds(points, times) == pytest.approx([0.3] * 1000)
    since = arm.system.now
    moved = follow(arm, points, blend=0.001, speed=speeds(points, times))
    fastest = np.abs(np.diff(commanded(arm, since), axis=0)).max(axis=1) / PERIOD_S
    assert fastest.max() <= 0.3 * 1.001
    assert times[-1] <= moved.duration < times[-1] + 2.0


@pytest.mark.parametrize(
    ("points", "times", "message"),
    [
        (
            [[0.0], [1.0], [2.0]],
            [0.0, 1.0, 1.0],
            "the time of waypoint 2, 1 s, is not after that of waypoint 1, 1 s; make the times strictly ascending",
        ),
        ([[0.0], [1.0]], [1.0, 0.5], "the time of waypoint 1, 0.5 s, is not after"),
        ([[0.0], [np.inf]], [0.0, 0.5], "not finite"),
        ([[0.0], [1.0]], [0.0], "pass one time for each"),
    ],
)
def test_times_that_do_not_ascend_are_refused(points: list[list[float]], times: list[float], message: str) -> None:
    with pytest.raises(gpac.CallError, match=message):
        speeds(points, times)


PLANNED = gpac.Verb(
    "planned",
    blocks={"planner": library.long_path_planner(waits=True, n=6), "generator": library.long_path_generator(n=6)},
    instantiation_parameters={"q": ["planner.start", "generator.start", "generator.setpoint"]},
    cells={"path": ["planner.path", "generator.path"]},
    input_parameters={"points": "planner.points", "blend": "planner.blend", "speed": "planner.speed"},
    output_values={"duration": "planner.duration"},
    command_lists={"start": [activate("planner", every="5 ms"), activate("generator", every="5 ms")]},
    conditions={"over": on("generator.finished", returns=["duration"])},
)


def table(seed: int) -> np.ndarray:
    """Returns a smooth path of six joints from zero, in a table of 16."""
    points = np.zeros((4096, 16))
    points[:, :6] = smooth(np.zeros(6), seed, 4096)
    return points


@pytest.mark.parametrize("place", ["virtual", "thread", "process"])
def test_a_long_plan_has_the_same_bits_wherever_it_is_made(place: str) -> None:
    points = table(12)
    with gpac.System("cell", clock="virtual" if place == "virtual" else "monotonic") as cell:
        source = cell.processor("rtp0", process=place == "process").timer("slow", period="5 ms", priority=50)
        q = cell.svv("q", "double[6]")
        moved = PLANNED.on(source)(q, points=points, blend=np.full(4096, 0.001), speed=np.full(4096, 3.0))
        assert np.array_equal(q.value, points[-1, :6])
    alone = library.long_path_planner.run(start=np.zeros((10, 6)), points=points, blend=np.full(4096, 0.001), speed=np.full(4096, 3.0))
    assert moved.outputs["duration"] == alone.path[-1]["duration"] == alone.duration[-1]


def test_a_recorded_long_path_is_run_again_to_the_bit(tmp_path: Path) -> None:
    record = tmp_path / "run.mcap"
    with gpac.System("cell", clock="virtual") as cell:
        cell.record(record, replay=True)
        source = cell.processor("rtp0").timer("slow", period="5 ms")
        q = cell.svv("q", "double[6]")
        PLANNED.on(source)(q, points=table(13), blend=np.full(4096, 0.001), speed=np.full(4096, 3.0))
    again = gpac.replay(record, show=["q"], trust=True)
    assert again.same
    assert again.firings > 20
