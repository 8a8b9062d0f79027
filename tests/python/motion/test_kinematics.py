# SPDX-License-Identifier: Apache-2.0
"""The kinematic blocks compared with MuJoCo's own numbers, and the geometry read from a model."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import opengpac as gpac
from opengpac import library as lib

MODEL = Path(gpac.robots.__file__).parent / "ur5e.xml"

GANTRY = """
<mujoco>
  <worldbody>
    <body name="beam" pos="0.1 0.2 0.3" euler="0 0 90">
      <joint name="x" type="slide" axis="1 0 0" range="-1 1"/><geom size="0.1" mass="1"/>
      <body name="turn" pos="0 0.1 0.2" euler="20 30 40">
        <joint name="y" type="slide" axis="0 1 1"/>
        <joint name="a" type="hinge" axis="0 1 2" pos="0.1 0 0" ref="20"/><geom size="0.1" mass="1"/>
        <body name="wrist" pos="0.3 0 0"><joint name="b" axis="1 1 0"/><geom size="0.05" mass="1"/>
          <site name="tool" pos="0 0.05 0.1" euler="10 0 60"/>
          <body name="left"><joint name="finger" type="slide" axis="1 0 0"/><geom size="0.01" mass="0.1"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="x"/><motor joint="y"/><motor joint="a"/><motor joint="b"/><motor joint="finger"/></actuator>
</mujoco>
"""


@pytest.fixture(scope="module")
def gantry_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes a model of two slides, two hinges with offsets, and a finger."""
    path = tmp_path_factory.mktemp("models") / "gantry.xml"
    path.write_text(GANTRY)
    return path


@pytest.fixture(params=["ur5e", "gantry"])
def model(request: pytest.FixtureRequest, gantry_file: Path) -> tuple[mujoco.MjModel, gpac.robots.Kinematics]:
    """Returns a model and the geometry read from it."""
    path = MODEL if request.param == "ur5e" else gantry_file
    loaded = mujoco.MjModel.from_xml_path(str(path))
    return loaded, gpac.robots.Kinematics.of_mjcf(path, [loaded.joint(j).name for j in range(loaded.njnt)])


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields a UR5e under the virtual clock."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system:
        yield made


def test_pose_and_jacobian_are_those_of_mujoco(model: tuple[mujoco.MjModel, gpac.robots.Kinematics]) -> None:
    loaded, kinematics = model
    data = mujoco.MjData(loaded)
    random = np.random.default_rng(1)
    for _ in range(50):
        data.qpos[:] = random.uniform(-3, 3, loaded.nq)
        mujoco.mj_forward(loaded, data)
        pose = kinematics.forward(data.qpos)
        assert np.abs(pose.position - data.site("tool").xpos).max() < 1e-9
        assert np.abs(pose.matrix[:3, :3] - data.site("tool").xmat.reshape(3, 3)).max() < 1e-9
        jacobian = np.zeros((6, loaded.nv))
        mujoco.mj_jacSite(loaded, data, jacobian[:3], jacobian[3:], loaded.site("tool").id)
        assert np.abs(kinematics.jacobian(data.qpos) - jacobian).max() < 1e-9


def test_base_and_tool_are_frames_before_and_after(model: tuple[mujoco.MjModel, gpac.robots.Kinematics]) -> None:
    _, kinematics = model
    q = np.linspace(-1, 1, len(kinematics.joints))
    plain = kinematics.forward(q)
    kinematics.base = gpac.Pose((1, 2, 3), rpy=(0, 0, "90 deg"))
    kinematics.tool = gpac.Pose((0, 0, "120 mm"), rpy=("45 deg", 0, 0))
    expected = kinematics.base @ plain @ kinematics.tool
    found = kinematics.forward(q)
    assert found.distance(expected) < 1e-12
    assert found.angle(expected) < 1e-12
    step = 1e-6
    for joint, column in enumerate(kinematics.jacobian(q).T):
        ahead, behind = (kinematics.forward(q + sign * step * np.eye(len(q))[joint]) for sign in (1, -1))
        assert np.allclose((ahead.position - behind.position) / (2 * step), column[:3], atol=1e-8)


def test_the_least_singular_value_is_that_of_numpy() -> None:
    kinematics = gpac.robots.Kinematics.of_mjcf(MODEL, ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"])
    random = np.random.default_rng(2)
    for _ in range(20):
        found = lib.jacobian.run(n=6, chain=kinematics.chain, q=random.uniform(-3, 3, 6).tolist())
        assert np.isclose(found.least[0], np.linalg.svd(found.jacobian[0].T, compute_uv=False)[-1], atol=1e-7)


def test_inverse_comes_back_to_any_pose(arm: gpac.robots.Arm) -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        q = random.uniform(-2.5, 2.5, 6)
        pose = arm.forward(q)
        found = arm.inverse(pose, near=q + random.uniform(-0.5, 0.5, 6))
        assert arm.forward(found).distance(pose) < 1e-8
        assert arm.forward(found).angle(pose) < 1e-8


def test_inverse_keeps_the_posture_near_by(arm: gpac.robots.Arm) -> None:
    q = np.array([0.3, -1.2, 1.4, -1.0, -1.3, 0.2])
    assert np.abs(arm.inverse(arm.forward(q), near=q + 0.1) - q).max() < 1e-6


def test_out_of_reach_and_out_of_range_are_told_apart(arm: gpac.robots.Arm) -> None:
    with pytest.raises(gpac.Unreachable, match=r"out of reach: the nearest solution is 2.* m away"):
        arm.inverse(gpac.Pose((3, 0, 0.3)), near=np.zeros(6))
    folded = arm.forward([0, -1, 2.0, 0, -1, 0])
    with pytest.raises(gpac.Unreachable, match="cannot be reached within the range of joint 'elbow'"):
        arm.kinematics.inverse(folded, [0, -1, 1.0, 0, -1, 0], position_min=[-6, -6, 0, -6, -6, -6], position_max=[6, 6, 1.5, 6, 6, 6])


def test_near_a_singularity_the_block_says_so(arm: gpac.robots.Arm) -> None:
    run = lib.inverse_kinematics.run
    bent, straight = [0, -1, 1.5, -1, -1.5, 0], [0, -1, 0.001, -1, -1.5, 0]
    for q, conditions in ((bent, []), (straight, ["singular"])):
        found = run(n=6, chain=arm.chain, goal=list(arm.forward(q)), near=q)
        assert [name for _, name, _ in found.conditions] == conditions
        assert found.reached[0]
    place = run(n=6, chain=arm.chain, goal=[*arm.forward(bent).position, 1, 0, 0, 0], near=straight, orientation=False)
    assert arm.forward(place.q[0]).distance(arm.forward(bent)) < 1e-6


def test_the_arm_knows_where_its_tool_is(arm: gpac.robots.Arm) -> None:
    home = arm.forward([joint.home for joint in arm])
    with arm.enabled():
        assert arm.pose().distance(home) < 1e-6
        arm.tool = gpac.Pose((0, 0, 0.1))
        # The tool points down at home.
        assert np.allclose(arm.pose().position, home.position - (0, 0, 0.1), atol=1e-6)
        assert arm.jacobian().shape == (6, 6)
    with pytest.raises(gpac.CallError, match="the chain needs 6 joint positions, not 5"):
        arm.forward([0] * 5)


def test_a_chain_that_is_none_is_a_fault_and_an_undriven_joint_is_refused(gantry_file: Path) -> None:
    assert lib.forward_kinematics.run(n=2, q=[0.0, 0.0]).fault is not None
    with pytest.raises(gpac.DefinitionError, match="joint 'a' moves the tool but is not driven"):
        gpac.robots.Kinematics.of_mjcf(gantry_file, ["x", "y", "b"])
    broken = gpac.robots.Kinematics([gpac.robots.Axis("a", 1, (0, 0, 2))], gpac.Pose())
    with pytest.raises(gpac.DefinitionError, match="unit vectors"):
        broken.forward([0.0])


@pytest.mark.parametrize(
    ("joints", "error", "says"),
    [
        ([], gpac.CallError, "a chain needs at least one joint; name the driven joints"),
        ("elbow", gpac.CallError, "the joints of a chain must be a list of names, not 'elbow'"),
        (None, gpac.CallError, "the joints of a chain must be a list of names, not None"),
        ([1], gpac.CallError, r"the joints of a chain must be a list of names, not \[1\]"),
        (["elbo"], gpac.UnknownName, "the model has no joint 'elbo'; did you mean 'elbow'"),
        (["shoulder_pan", "shoulder_pan"], gpac.CallError, "joint 'shoulder_pan' occurs twice"),
    ],
)
def test_a_chain_of_joints_that_are_none_is_refused(joints: Any, error: type[gpac.Error], says: str) -> None:
    with pytest.raises(error, match=says):
        gpac.robots.Kinematics.of_mjcf(MODEL, joints)


def test_empty_lists_and_other_values_are_refused_in_words(arm: gpac.robots.Arm) -> None:
    nothing: Any = gpac.robots.Kinematics([], gpac.Pose())
    for call in (nothing.forward, nothing.jacobian, lambda q: nothing.inverse(gpac.Pose(), q)):
        with pytest.raises(gpac.DefinitionError, match="a chain cannot have 0 joints; use 1 to 16 axes"):
            call([])
    for odd in ("x", None, [[0.0] * 6], ["1"] * 6):
        with pytest.raises(gpac.CallError, match="is not a list of joint positions; pass a number for each joint"):
            arm.forward(odd)  # pyright: ignore[reportArgumentType]
    with pytest.raises(gpac.UnknownName, match="the model has no site 'hand'"):
        gpac.robots.Kinematics.of_mjcf(MODEL, ["elbow"], site="hand")
    for centre in ((), (1.0,), 2.0):
        with pytest.raises(gpac.CallError, match=r"the centre of mass of a payload must be three coordinates, not"):
            gpac.robots.Payload(1.0, centre)  # pyright: ignore[reportArgumentType]


def test_forward_kinematics_runs_in_a_verb(arm: gpac.robots.Arm) -> None:
    watch = gpac.Verb(
        "watch",
        blocks={"tool": lib.forward_kinematics(chain=arm.chain)},
        objects={"arm": gpac.each(gpac.robots.Joint)},
        instantiation_parameters={"arm.sensed": "tool.q", "pose": "tool.pose"},
        modes={"tool.q": "asynchronous"},
        command_lists={"start": [gpac.activate("tool", every="20 ms")]},
    )
    pose = arm.system.svv("pose", "double[7]")
    with arm.enabled(), watch.asynch(arm, pose):
        arm.system.advance("100 ms")
        assert gpac.Pose.of(pose.value).distance(arm.pose()) < 1e-6
