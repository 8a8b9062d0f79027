# SPDX-License-Identifier: Apache-2.0
"""A queue of moves of a UR5e under the virtual clock: appended while earlier ones run, blended, paused, run back, halted and refused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion
from opengpac.motion import MoveRefused
from tool_path import places

HOME = gpac.deg([0, -90, 90, -90, -90, 0])


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields an enabled UR5e at home."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system, made.enabled():
        motion.move_absolute(made, HOME)
        yield made


def by(*shifts: float) -> np.ndarray:
    """Returns the home position with the first joints displaced."""
    return HOME + np.array([*shifts, *[0.0] * (6 - len(shifts))])


def commanded(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the set-points since a time: one row each."""
    columns = [joint.commanded.history[:] for joint in arm]
    return np.array([column["value"][column["time"] > since] for column in columns]).T


def away(shift: tuple[float, float, float], start: gpac.Pose) -> gpac.Pose:
    """Returns a pose displaced from another along the world's axes."""
    return gpac.Pose(shift) @ start


def test_moves_run_in_their_order_and_the_end_is_exact(arm: gpac.robots.Arm) -> None:
    start = arm.forward(HOME)
    with arm.queue() as moves:
        assert moves.joints(by(0.6, -0.3, 0.4), speed="60 %", blend="40 %") == 1
        assert moves.linear(start, speed="500 mm/s", acceleration=3.0, blend="60 mm") == 2
        assert moves.circular(away((0.05, 0.05, 0), start), away((0.1, 0, 0), start), speed=0.5, acceleration=3.0) == 3
    report = moves.report
    assert report is not None and (report.condition, [end.number for end in report.moves]) == ("arrived", [1, 2, 3])
    assert report.moves[0].reason == "as requested" and report.moves[0].kept == 1.0
    assert arm.forward(arm.values("commanded")).distance(away((0.1, 0, 0), start)) < 1e-6
    assert (moves.number, moves.fraction) == (3, 1.0)


def test_moves_are_appended_while_earlier_ones_run_and_blends_save_time(arm: gpac.robots.Arm) -> None:
    durations = []
    for blend in ("0 %", "40 %"):
        begun = arm.system.now
        with arm.queue() as moves:
            first = moves.joints(HOME + 0.3, speed="60 %", blend=blend)
            moves.wait(first, fraction=0.2)
            assert 0 < moves.fraction < 1
            for goal in (by(0.8, -0.7), by(0.0, -0.7, 0.7), HOME):
                moves.joints(goal, speed="60 %", blend=blend)
        durations.append(arm.system.now - begun)
    assert durations[1] < 0.95 * durations[0], durations


def test_the_path_is_the_same_at_any_speed_paused_and_run_back(arm: gpac.robots.Arm) -> None:
    start = arm.forward(HOME)

    def travel(change: bool) -> np.ndarray:
        since = arm.system.now
        with arm.queue() as moves:
            moves.linear(away((0.15, 0, 0), start), speed=0.3, blend="50 mm")
            moves.linear(away((0.15, 0.15, 0), start), speed=0.3)
            if change:
                arm.system.advance("400 ms")
                arm.override = 0.4
                arm.system.advance("200 ms")
                moves.rate = -1.0
                arm.system.advance("600 ms")
                moves.rate = 0.0
                arm.system.advance("600 ms")
                stands = arm.values("commanded")
                arm.system.advance("200 ms")
                assert np.array_equal(arm.values("commanded"), stands), "it rests on its path"
                moves.rate, arm.override = 1.0, 1.0
        motion.move_absolute(arm, HOME)
        return places(arm, commanded(arm, since))

    plain, changed = travel(False), travel(True)
    # Both are points of one curve: each of the second is near a chord of the first.
    for point in changed:
        a, b = plain[:-1], plain[1:]
        way = b - a
        share = np.clip(((point - a) * way).sum(1) / np.maximum((way * way).sum(1), 1e-18), 0, 1)
        assert np.linalg.norm(a + share[:, None] * way - point, axis=1).min() < 2e-4


def test_a_halt_comes_to_rest_on_the_path(arm: gpac.robots.Arm) -> None:
    start = arm.forward(HOME)
    with pytest.raises(RuntimeError, match="enough"), arm.queue() as moves:
        moves.linear(away((0, 0.2, 0), start), speed=0.3)
        arm.system.advance("500 ms")
        raise RuntimeError("enough")
    tool = arm.forward(arm.values("commanded"))
    assert 0.03 < tool.position[1] - start.position[1] < 0.19
    assert abs(tool.position[0] - start.position[0]) < 1e-6 and abs(tool.position[2] - start.position[2]) < 1e-6
    stood = arm.values("commanded")
    arm.system.advance("500 ms")
    assert np.array_equal(arm.values("commanded"), stood)


def test_a_moving_arm_is_braked_first(arm: gpac.robots.Arm) -> None:
    going = motion.move_velocity.asynch(arm["wrist_3"], 0.5)
    arm.system.advance("1 s")
    going.halt()
    with arm.queue() as moves:
        moves.joints({"wrist_3": 0.0}, speed="50 %")
    assert abs(arm["wrist_3"].commanded.value) < 1e-12


def test_what_is_wrong_in_a_call_is_refused_there(arm: gpac.robots.Arm) -> None:
    with arm.queue() as moves:
        with pytest.raises(gpac.OutOfRange, match=r"did you mean '90 deg'\?"):
            moves.joints({"elbow": 90})
        with pytest.raises(gpac.OutOfRange, match=r"'speed' for 'ur5e\.shoulder_pan' is 100 rad/s"):
            moves.joints(HOME, speed="100 rad/s")
        with pytest.raises(gpac.CallError, match="'mode' must be 'blending', 'buffered' or 'aborting', not 'aborted'"):
            moves.joints(HOME, mode="aborted")  # type: ignore[arg-type]
        with pytest.raises(gpac.OutOfRange, match="is 120 %, but its range is 0 to 100 %"):
            moves.joints(HOME, blend="120 %")
        with pytest.raises(gpac.UnknownName, match="'elbwo'"):
            moves.joints({"elbwo": 1.0})
        with pytest.raises(gpac.OutOfRange, match="'speed' must be above 0"):
            moves.linear(arm.pose(), speed=0)
        moves.linear(away((0.01, 0, 0), arm.pose()))
        with pytest.raises(gpac.CallError, match="cannot follow a move of the tool"):
            moves.joints({"elbow": 1.0})


def test_a_move_that_the_arm_cannot_make_is_refused_and_those_before_it_are_made(arm: gpac.robots.Arm) -> None:
    start = arm.forward(HOME)
    goal = HOME + 0.1
    with (
        pytest.raises(MoveRefused, match=r"move 2 of the queue: a point on its path is .* m out of reach") as refused,
        arm.queue() as moves,
    ):
        moves.joints(goal, speed="50 %", blend="50 %")
        moves.linear(away((3, 0, 0), start))
        moves.joints(HOME)
    assert (refused.value.move, refused.value.reason) == (2, "unreachable")
    assert (arm.values("commanded") == goal).all(), "the first move is complete, its goal exact"


def test_a_blend_that_does_not_fit_says_why(arm: gpac.robots.Arm) -> None:
    with arm.queue() as moves:
        moves.joints(by(0.8), blend="80 %", speed="50 %")
        moves.joints(by(0.8, 0.0, 0.8), blend="0.3 rad", speed="50 %")
        moves.joints(HOME, blend="0.1 rad", mode="buffered")
    assert moves.report is not None
    reasons = {end.number: end.reason for end in moves.report.moves}
    assert reasons[1] == "it would have taken more than half of the move"
    assert reasons[2] == "the next move does not blend, or does not exist"
    assert reasons[3] == "the next move does not blend, or does not exist"


def test_more_moves_than_places_wait_for_a_place(arm: gpac.robots.Arm) -> None:
    # The second queue does not take the progress of the first for its own.
    for _ in range(2):
        with arm.queue() as moves:
            assert (moves.number, moves.ends) == (0, [])
            for k in range(60):
                moves.joints(HOME + 0.05 * (k % 3), speed="80 %", blend="30 %")
        assert moves.report is not None and [end.number for end in moves.report.moves] == list(range(29, 61))
        assert (arm.values("commanded") == HOME + 0.05 * (59 % 3)).all()


def test_a_suspended_queue_goes_on_where_it_stood(arm: gpac.robots.Arm) -> None:
    with arm.queue() as moves:
        moves.joints(HOME + 0.5, speed="50 %")
        moves.wait(1, fraction=0.3)
        names = arm.system.pause()
        stood = arm.values("commanded")
        arm.system.advance("1 s")
        assert names and np.array_equal(arm.values("commanded"), stood) and moves.fraction < 1
        arm.system.resume()
    assert (arm.values("commanded") == HOME + 0.5).all()


def test_a_wait_ends_in_its_time(arm: gpac.robots.Arm) -> None:
    with arm.queue() as moves:
        moves.joints(by(0.5), speed="10 %")
        with pytest.raises(TimeoutError):
            moves.wait(1, within="200 ms")
        with pytest.raises(gpac.OutOfRange, match="only 1 moves were appended"):
            moves.wait(2)


def test_a_queue_is_used_once_and_only_in_its_statement(arm: gpac.robots.Arm) -> None:
    moves = arm.queue()
    with pytest.raises(gpac.InvalidState, match="has not been started"):
        moves.joints(HOME)
    with moves:
        moves.joints(HOME + 0.05)
    with pytest.raises(gpac.InvalidState, match="has already been used"), moves:
        pass


def test_a_processor_in_a_process_gives_the_same_bits() -> None:
    found = []
    for process in (False, True):
        with gpac.System("mapped", clock="virtual", seed=1) as cell:
            rtp = cell.processor("rtp0", process=process)
            fast = rtp.timer("fast", period="1 ms", priority=80)
            rtp.timer("slow", period="20 ms", priority=60)
            made = gpac.robots.load("ur5e", on=fast)
            with made.enabled():
                motion.move_absolute(made, HOME)
                start = made.forward(HOME)
                with made.queue() as moves:
                    moves.linear(away((0.15, 0, 0), start), speed=0.4, acceleration=3.0, blend="50 mm")
                    moves.linear(away((0.15, 0.15, 0), start), speed=0.4, acceleration=3.0, blend="50 mm")
                    moves.joints(HOME, speed="50 %")
                found.append(commanded(made, 0.0))
    assert len(found[0]) > 50 and np.array_equal(*found)


@pytest.fixture
def glueing() -> Iterator[tuple[gpac.robots.Arm, gpac.cell.DigitalOutput]]:
    """Yields an enabled UR5e at home, and an output beside it."""
    with gpac.System("glueing", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        rtp.timer("slow", period="20 ms", priority=60)
        made = gpac.robots.load("ur5e", on=fast)
        channel = {"name": "glue", "direction": "write", "type": "bool"}
        io = rtp.physical_device("io", gpac.drivers.scripted([channel], []), exchange=fast)
        glue = gpac.cell.DigitalOutput("glue", io["glue"])
        with made.enabled(), glue.enabled():
            motion.move_absolute(made, HOME)
            yield made, glue


def test_outputs_are_switched_at_their_places(glueing: tuple[gpac.robots.Arm, gpac.cell.DigitalOutput]) -> None:
    arm, glue = glueing
    start = arm.forward(HOME)
    for override in (0.3, 1.0):
        motion.move_absolute(arm, HOME)
        arm.override = override
        seen: list[tuple[float, bool]] = []
        with arm.queue(outputs=[glue]) as moves:
            marks = [motion.at(glue, False, before="50 mm"), motion.at(glue, before="150 mm")]
            moves.linear(away((0.2, 0, 0), start), speed=0.2, marks=marks)
            while not seen or moves.fraction < 1:
                arm.system.advance("20 ms")
                seen.append((moves.fraction, bool(glue.commanded.value)))
        arm.override = 1.0
        step, on = 1.01 * override * 0.02, [fraction for fraction, is_on in seen if is_on]
        assert 0.25 <= min(on) < 0.25 + step and 0.75 - step <= max(on) < 0.75, (min(on), max(on), step)
    with arm.queue() as moves, pytest.raises(gpac.CallError, match="'glue' is not an output of this queue"):
        moves.joints(HOME, marks=[motion.at(glue)])


def test_an_aborting_move_replaces_those_before_it(arm: gpac.robots.Arm) -> None:
    with arm.queue() as moves:
        moves.joints(by(0.8), speed="50 %")
        for k in range(15):
            moves.joints(by(0.8, -0.05 * k), speed="50 %")
        arm.system.advance("500 ms")
        assert moves.number == 1
        last = moves.joints(by(-0.4, -0.3), speed="60 %", mode="aborting")
        assert last == 17
    assert (arm.values("commanded") == by(-0.4, -0.3)).all()
    assert moves.report is not None
    ends = {end.number: end.reason for end in moves.report.moves}
    assert {ends[k] for k in range(1, 17)} == {"a later move replaced it"} and ends[17] == "as requested"


def test_single_steps_go_from_move_to_move_and_back(arm: gpac.robots.Arm) -> None:
    goals = [by(0.4), by(0.4, -0.4), HOME]
    with arm.queue(rate=0) as moves:
        for goal in goals:
            moves.joints(goal, speed="60 %")
        for count, goal in ((1, goals[0]), (1, goals[1]), (-1, goals[0]), (-1, HOME), (2, goals[1])):
            moves.step(count)
            assert moves.resting and np.allclose(arm.values("commanded"), goal, atol=1e-12), (count, moves.number)
        with pytest.raises(gpac.OutOfRange, match="'moves' is 0, but its range is 1 to 16"):
            moves.step(0)
        moves.rate = 1
    assert (arm.values("commanded") == HOME).all()


def test_a_move_takes_its_duration(arm: gpac.robots.Arm) -> None:
    start = arm.forward(HOME)
    with arm.queue() as moves:
        first = moves.linear(away((0.1, 0, 0), start), duration="2 s")
        begun = arm.system.now
        moves.wait(first)
        assert 1.95 < arm.system.now - begun < 2.1
        moves.joints(HOME, duration="1500 ms")
        with pytest.raises(gpac.OutOfRange, match="'duration' must be above 0 s, not 0"):
            moves.joints(HOME, duration=0)
    least = r"move 1 of the queue: within its limits, it takes at least 0\.\d+ s"
    with pytest.raises(MoveRefused, match=least) as refused, arm.queue() as moves:
        moves.linear(away((0.1, 0, 0), start), duration="100 ms")
    assert refused.value.reason == "duration" and 0.3 < refused.value.value < 1.0


def test_a_blend_is_an_angle_of_the_orientation_and_a_pose_is_in_a_work_frame(arm: gpac.robots.Arm) -> None:
    start = arm.forward(HOME)
    frame = gpac.Pose((0.1, -0.2, 0.05), rpy=(0, 0, "30 deg"))
    turned = away((0.15, 0, 0), start @ gpac.Pose((0, 0, 0), rpy=(0, 0, "40 deg")))
    goal = away((0.15, 0.15, 0), turned)
    with arm.queue() as moves:
        moves.linear(frame.inverse() @ turned, frame=frame, blend="10 deg")
        moves.linear(goal)
    assert arm.forward(arm.values("commanded")).distance(goal) < 1e-6
    assert moves.report is not None and moves.report.moves[0].reason == "as requested"


@pytest.mark.parametrize("category", [1, 2])
def test_stops_of_category_1_and_2_keep_the_path(arm: gpac.robots.Arm, category: Literal[1, 2]) -> None:
    start = arm.forward(HOME)
    with arm.queue() as moves:
        moves.linear(away((0, 0.2, 0), start), speed=0.3)
        arm.system.advance("500 ms")
        with pytest.raises(gpac.OutOfRange, match="'category' must be 1 or 2, not 0"):
            moves.stop(0)  # type: ignore[arg-type]
        moves.stop(category)
        place = arm.forward(arm.values("commanded"))
        assert abs(place.position[0] - start.position[0]) < 1e-6 and 0.02 < place.position[1] - start.position[1] < 0.19
        assert [joint.state for joint in arm] == ["disabled" if category < 2 else "moving"] * 6
        if category == 2:
            moves.rate = 1
    assert (moves.report is None) == (category < 2)
    if category == 2:
        assert arm.forward(arm.values("commanded")).distance(away((0, 0.2, 0), start)) < 1e-6
