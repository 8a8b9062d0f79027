# SPDX-License-Identifier: Apache-2.0
"""Taught points that are poses: they move with their frame, are valid for each tool, and are reached in their configuration."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import opengpac as gpac
from opengpac.devices.point import PointEntry
from opengpac.motion import move_linear
from opengpac.robots import Arm, load, move
from opengpac.robots.closed_forms import ClosedForms
from opengpac.robots.kinematics import HINGE, Axis, Kinematics

READY = {"ur5e": [0.3, -1.2, 1.4, -1.8, -1.5, 0.2], "panda": [0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.6]}


@pytest.fixture(params=["ur5e", "panda"])
def arm(request: pytest.FixtureRequest) -> Iterator[Arm]:
    with gpac.System("cell", clock="virtual") as cell:
        made = load(request.param, on=cell.processor("rtp0").timer("fast", period="1 ms", priority=80)).enable()
        move(made, goal=READY[request.param])
        yield made


@pytest.fixture
def ur5e() -> Iterator[Arm]:
    with gpac.System("cell", clock="virtual") as cell:
        made = load("ur5e", on=cell.processor("rtp0").timer("fast", period="1 ms", priority=80)).enable()
        move(made, goal=READY["ur5e"])
        yield made


def test_a_point_moves_with_its_frame_and_holds_for_each_tool(arm: Arm, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", arm)
    points.frames["table"] = gpac.Frame((0.3, 0.1, 0.05), rpy=(0, 0, "20 deg"))
    arm.tool = gpac.Frame((0, 0, 0.1))
    place = arm.pose()
    taught = points.teach("pick", frame="table", note="above the tray")
    assert dict(taught) == pytest.approx(dict(zip(taught, arm.values("sensed"), strict=True)), abs=1e-8)
    assert taught.pose.distance(place) < 1e-8
    arm.tool = gpac.Frame((0.01, 0, 0.13), rpy=("5 deg", 0, 0))
    points.frames["table"] = gpac.Frame((0.31, 0.08, 0.06), rpy=(0, 0, "23 deg"))
    wanted = points.frames["table"] @ taught.in_frame
    move(arm, goal=points["pick"], tolerance=0.0005)
    assert arm.forward(points["pick"].array).distance(wanted) < 1e-6
    assert arm.pose().distance(wanted) < 0.002, "the servo's error is left"
    move(arm, goal=READY[arm.name])
    assert move_linear(arm, points["pick"].pose).condition == "arrived"


@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_200_points_are_the_same_places_with_another_tool_frame_and_base(name: str, tmp_path: Path) -> None:
    random = np.random.default_rng(31 if name == "ur5e" else 34)
    with gpac.System("cell", clock="virtual") as cell:
        arm = load(name, on=cell.processor("rtp0").timer("fast", period="1 ms", priority=80))
        low, high = (np.array(arm.values(member)) for member in ("position_min", "position_max"))
        points = gpac.Points(tmp_path / "points.toml", arm)
        points["p"] = READY[name]
        frame = gpac.Frame((0.4, -0.2, 0.1), rpy=(0.1, -0.2, 0.3))
        points.frames["work"] = frame
        document = points._document
        reached, worst = 0, 0.0
        for _ in range(200):
            q = np.clip(random.uniform(low, high), -3.1, 3.1) * 0.8 + (low + high) * 0.1
            arm.tool, arm.base = gpac.Frame((0.02, 0, 0.1)), gpac.Frame()
            entry = points._placed(document, "p", arm, _entry_of(arm, q))
            # A slightly longer and turned tool, and a displaced arm: the pose of the tool stays.
            arm.tool = gpac.Frame((0.02, 0.004, 0.105), rpy=random.uniform(-0.05, 0.05, 3))
            arm.base = gpac.Frame(random.uniform(-0.01, 0.01, 3), rpy=random.uniform(-0.02, 0.02, 3))
            try:
                joints, goal = points._reached(document, "p", entry, arm)
            except gpac.Unreachable:
                continue
            reached += 1
            there = arm.forward(joints.values())
            assert goal.distance(frame @ entry.pose) < 1e-10, "as the file has the frame"
            worst = max(worst, there.distance(goal), there.angle(goal))
            if entry.configuration is not None:
                assert arm.configuration(joints.values()).signs == entry.configuration.signs
        assert worst < 1e-6
        # At the edge of the workspace or of a range no joint positions exist for the changed pose.
        assert reached > 150


def _entry_of(arm: Arm, q: np.ndarray) -> PointEntry:
    return PointEntry(dict(zip([joint.short_name for joint in arm], map(float, q), strict=True)), "work")


def test_all_solutions_and_a_chosen_configuration(ur5e: Arm) -> None:
    pose = ur5e.pose()
    found = ur5e.solutions(pose)
    assert {ur5e.configuration(q).signs for q in found} == {a + b + c for a in "+-" for b in "+-" for c in "+-"}
    assert max(ur5e.forward(q).distance(pose) for q in found) < 1e-9
    for q in found:
        chosen = ur5e.inverse(pose, configuration=ur5e.configuration(q).signs)
        assert ur5e.forward(chosen).distance(pose) < 1e-9
        assert ur5e.configuration(chosen).signs == ur5e.configuration(q).signs
    wound = ur5e.values("sensed") + np.array([0, 0, 0, 0, 0, -2 * np.pi])
    assert ur5e.configuration(wound).turns == (0, 0, 0, 0, 0, -1)
    assert ur5e.inverse(pose, configuration=ur5e.configuration(wound)) == pytest.approx(wound, abs=1e-9)
    for wrong in ("up", 7, ["+"]):
        with pytest.raises(gpac.ValueRefused, match="for example"):
            ur5e.inverse(pose, configuration=wrong)  # type: ignore[arg-type]
    for signs, turns in (((2, 1, 1), ()), ((1, 1, np.ones(2)), ()), ((1, 1, 1), 5), ((1, 1, 1), (0.5,))):
        with pytest.raises(gpac.ValueRefused):
            gpac.Configuration(*signs, turns=turns)  # type: ignore[arg-type]
    with pytest.raises(gpac.Unreachable, match="out of reach in the configuration"):
        ur5e.inverse(gpac.Pose((3, 0, 0)), configuration="+++")
    with pytest.raises(gpac.Unreachable, match="needs joint 'elbow'"):
        ur5e.inverse(pose, configuration=gpac.Configuration.of("+++", [0, 0, 1, 0, 0, 0]))


def test_a_chain_without_closed_forms_says_so() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        panda = load("panda", on=cell.processor("rtp0").timer("fast", period="1 ms", priority=80)).enable()
        with pytest.raises(gpac.DefinitionError, match="no inverse in closed form"):
            panda.configuration()
        with pytest.raises(gpac.DefinitionError, match="near="):
            panda.inverse(panda.pose(), configuration="+++")


def _spherical() -> Kinematics:
    """Returns an arm with a spherical wrist, an offset shoulder and axes that are turned against each other."""
    axes = [
        Axis("j1", HINGE, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
        Axis("j2", HINGE, (0.0, 1.0, 0.0), (0.15, 0.0, 0.45)),
        Axis("j3", HINGE, (0.0, 1.0, 0.0), (0.15, 0.1, 1.05)),
        Axis("j4", HINGE, (1.0, 0.0, 0.0), (0.3, 0.05, 1.17)),
        Axis("j5", HINGE, (0.0, 1.0, 0.0), (0.8, 0.05, 1.17)),
        Axis("j6", HINGE, (1.0, 0.0, 0.0), (0.9, 0.05, 1.17)),
    ]
    return Kinematics(axes, gpac.Pose((0.95, 0.05, 1.17), rpy=(0.1, 0.2, 0.3)), tool=gpac.Pose((0.01, 0.02, 0.1)))


def _placed(arm: Kinematics, q: np.ndarray) -> np.ndarray:
    """Returns the matrix of the tool at joint positions, by SciPy."""
    found = np.eye(4)
    for axis, angle in zip(arm.axes, q, strict=True):
        turn = Rotation.from_rotvec(np.array(axis.direction) * angle).as_matrix()
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = turn, np.array(axis.point) - turn @ np.array(axis.point)
        found = found @ own
    return found @ (arm.home @ arm.tool).matrix


def _is_singular(arm: Kinematics, q: np.ndarray) -> bool:
    """Returns whether some small turns of the joints move the tool a thousand times less than they could."""
    step = 1e-6
    columns = [(_placed(arm, q + step * row) - _placed(arm, q - step * row)).ravel() / (2 * step) for row in np.eye(len(q))]
    return bool(np.linalg.svd(np.array(columns))[1].min() < 1e-3)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.floats(-3.1, 3.1), min_size=6, max_size=6))
def test_closed_forms_of_a_spherical_wrist_have_the_joints_among_them(given: list[float]) -> None:
    arm, q = _spherical(), np.array(given)
    forms = ClosedForms.of(arm)
    assert forms is not None
    goal = _placed(arm, q)
    found = forms.all(gpac.Pose(goal[:3, 3], quaternion=np.roll(Rotation.from_matrix(goal[:3, :3]).as_quat(), 1)), q)
    assert found
    assert max(np.abs(_placed(arm, one) - goal).max() for one in found) < 1e-6
    if not _is_singular(arm, q):
        assert min(np.abs(np.angle(np.exp(1j * (one - q)))).max() for one in found) < 1e-5
        assert forms.configuration(q).signs in {forms.configuration(one).signs for one in found}
        assert len({forms.configuration(one).signs for one in found}) == len(found)


def test_a_frame_that_points_are_of_stays(ur5e: Arm, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", ur5e)
    points.frames["table"] = gpac.Frame((0.3, 0, 0))
    points.tools["pen"] = gpac.Frame((0, 0, 0.15))
    points.teach("pick", frame="table", tool="pen")
    points["copy"] = points["pick"]
    assert (points["copy"].frame, points["copy"].tool) == ("table", "pen")
    del points["copy"]
    line = next(line for line in points.path.read_text().split("\n") if line.startswith("pick"))
    assert line.startswith('pick = {frame = "table", tool = "pen", position = [')
    cases = [
        (gpac.ValueRefused, "point 'pick' uses it", lambda: points.frames.__delitem__("table")),
        (gpac.ValueRefused, "point 'pick' uses it", lambda: points.tools.__delitem__("pen")),
        (gpac.UnknownName, "did you mean 'table'", lambda: points.teach("p", frame="tabel")),
        (gpac.UnknownName, "is not in '", lambda: points.teach("p", frame="world", tool="gripper")),
        (gpac.CallError, "a tool but no frame", lambda: points.teach("p", tool="pen")),
        (gpac.CallError, "a frame cannot be named", lambda: points.frames.__setitem__("world", gpac.Pose())),
        (gpac.ValueRefused, "is stored as a pose in 'table'", lambda: points.edit("pick", {"elbow": 1.0})),
        (gpac.CallError, "requires the geometry of its arm", lambda: gpac.Points(points.path)["pick"].pose),
    ]
    before = points.path.read_text()
    for kind, says, call in cases:
        with pytest.raises(kind, match=says):
            call()
    assert points.path.read_text() == before
    points.edit("pick", pose=gpac.Pose((5, 0, 0)))
    with pytest.raises(gpac.Unreachable, match="point 'pick'"):
        dict(points["pick"])
    del points["pick"]
    del points.frames["table"]
    assert list(points.frames) == []


WHOLE = """# Taught points, one a line.
format = 2
[arm]
name = "arm"
model = "m"
joints = ["x", "y"]
units = ["rad", "mm"]
[frames]
table = {position = [0.1, 0.2, 0.3], rpy_deg = [0.0, 0.0, 90.0]}
[tools]
pen = {position = [0.0, 0.0, 0.1]}
[points]
a = {joints = [1.0, 2.0], note = "n"}
b = {frame = "table", tool = "pen", position = [0.1, 0.2, 0.3], configuration = "+-+", turns = [0, 0], joints = [1.0, 2.0]}
[points.c]
joints = {x = 1.0, y = 2.0}
taught = 2026-11-29T20:00:00Z
"""
WORDS = [
    "[",
    "]",
    "{",
    "}",
    "=",
    '"',
    "\n",
    "nan",
    "-",
    "1e400",
    "true",
    "[[x]]",
    "points",
    "[points.a]",
    "inf",
    "'''",
    "\\u0000",
    "1979-05-27",
    ".",
]


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(st.integers(0, len(WHOLE)), st.integers(0, 12), st.one_of(st.sampled_from(WORDS), st.text(max_size=3))),
        min_size=1,
        max_size=4,
    )
)
def test_a_damaged_file_never_gives_a_traceback(tmp_path: Path, damages: list[tuple[int, int, str]]) -> None:
    text = WHOLE
    for at, length, put in damages:
        text = text[:at] + put + text[at + length :]
    path = tmp_path / "points.toml"
    try:
        path.write_text(text, encoding="utf-8")
    except UnicodeEncodeError:
        return
    try:
        points = gpac.Points(path)
        for name in list(points):
            assert points[name].name == name
        repr(points)
        repr(points.frames)
        points[next(iter(points), "a")] = [0.0] * len(points.joints) if points.joints else {}
    except gpac.Error as error:
        assert error.remedy
