# SPDX-License-Identifier: Apache-2.0
"""Data taken from models of arms: the tool of each of two in one world, limits of speed, URDF, the tip of a tool."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import robots
from opengpac.storage.cache import keep

ARM = """<body name="{p}base" pos="0 {y} 0"><body name="{p}upper">
<joint name="{p}turn" axis="0 0 1" range="-2 2"/><geom size="0.02" mass="1"/>
<body name="{p}fore" pos="0.4 0 0"><joint name="{p}reach" type="slide" axis="1 0 0" range="0 0.3"/><geom size="0.02" mass="1"/>
<site name="{p}{tool}" pos="0.1 0 0"/></body></body></body>"""
LEFT, RIGHT = ARM.format(p="", y=0, tool="tool"), ARM.format(p="r_", y=2, tool="attachment_site")
TWO_ARMS = f"""<mujoco><compiler angle="radian"/><worldbody>{LEFT}{RIGHT}
</worldbody><actuator><motor joint="turn"/><velocity joint="reach" kv="5" ctrlrange="-0.4 0.4" gear="2"/>
<motor joint="r_turn"/><motor joint="r_reach"/></actuator><sensor><force name="force" site="tool"/></sensor></mujoco>"""

URDF = """<robot name="arm"><link name="world"/>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.5"/></joint>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="30" velocity="1.5"/></joint>
<link name="upper"><inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry>{shape}</geometry></collision></link>
<joint name="reach" type="prismatic"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.3" effort="100" velocity="0"/></joint>
<link name="fore"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="flange" type="fixed"><parent link="fore"/><child link="tool0"/><origin xyz="0.1 0 0"/></joint><link name="tool0"/></robot>"""

TOOL = """<mujoco><compiler angle="radian"/><worldbody><body name="pin">
<geom size="0.01" mass="0.1"/><site name="tcp" pos="0 0 0.2"/></body></worldbody></mujoco>"""


def written(folder: Path, name: str, text: str) -> Path:
    """Writes a file with that text."""
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize(("prefix", "y"), [("", 0.0), ("r_", 2.0)])
def test_each_of_two_arms_in_a_world_has_its_own_tool(tmp_path: Path, prefix: str, y: float) -> None:
    file = written(tmp_path, "both.xml", TWO_ARMS)
    kinematics = robots.Kinematics.of_mjcf(file, [f"{prefix}turn", f"{prefix}reach"])
    assert np.allclose(kinematics.forward([0.0, 0.2]).position, [0.7, y, 0.0])
    assert np.allclose(kinematics.forward([np.pi / 2, 0.0]).position, [0.0, y + 0.5, 0.0])


def test_limits_of_speed_come_from_the_model_and_sliding_joints_are_slow(tmp_path: Path) -> None:
    with gpac.System("two", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        rtp.timer("fast", period="1 ms", priority=80)
        arm = robots.load(written(tmp_path, "both.xml", TWO_ARMS), rtp)
        assert dict(zip((joint.short_name for joint in arm), arm.values("max_speed"), strict=True)) == pytest.approx(
            {"turn": 3.14, "reach": 0.2, "r_turn": 3.14, "r_reach": 0.25}
        )
        assert arm["reach"].jog_speed <= arm["reach"].max_speed and arm["r_reach"].max_acceleration == 1.0


def test_an_arm_is_loaded_from_urdf_and_moves(tmp_path: Path) -> None:
    arm = robots.load(written(tmp_path, "arm.urdf", URDF.format(shape='<box size="0.1 0.1 0.1"/>')), clock="virtual")
    with arm.system:
        assert [joint.short_name for joint in arm] == ["turn", "reach"]
        assert arm.values("max_speed") == [1.5, 0.25] and arm.values("max_effort") == [30.0, 100.0]
        assert arm.values("position_max") == [2.0, pytest.approx(0.3)]
        assert np.allclose(arm.forward([0.0, 0.0]).position, [0.5, 0.0, 0.5]), "the flange is the last link"
        arm.enable()
        report = gpac.motion.move_absolute(arm, [1.0, 0.2], time_limit="20 s")
        assert np.allclose(report.position, [1.0, 0.2], atol=0.005)
        assert np.allclose(arm.pose().position, [0.7 * np.cos(1.0), 0.7 * np.sin(1.0), 0.5], atol=0.01)


def test_meshes_of_a_urdf_lie_beside_it_whatever_package_they_name(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], dtype="<f4")
    faces = b"".join(
        np.zeros(3, "<f4").tobytes() + corners[[*face]].tobytes() + b"\0\0" for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    )
    (tmp_path / "upper.stl").write_bytes(b"\0" * 80 + np.array([4], "<u4").tobytes() + faces)
    file = written(tmp_path, "arm.urdf", URDF.format(shape='<mesh filename="package://maker/meshes/upper.stl"/>'))
    arm = robots.load(file, clock="virtual")
    arm.system.close()
    (tmp_path / "upper.stl").unlink()
    with pytest.warns(UserWarning, match=r"mesh 'package://maker/meshes/upper.stl' was not found and is ignored"):
        robots.load(file, clock="virtual").system.close()


def test_the_tip_of_a_tool_is_the_tool_of_the_arm(tmp_path: Path) -> None:
    arm = robots.load("ur5e", clock="virtual", tool=written(tmp_path, "pin.xml", TOOL))
    with arm.system:
        arm.enable()
        bare = robots.Kinematics.of_mjcf(Path(robots.__file__).parent / "ur5e.xml", [joint.short_name for joint in arm])
        assert np.allclose(arm.tool.position, [0.0, 0.0, 0.2])
        q = arm.values("sensed")
        assert np.allclose(arm.pose().position, (bare.forward(q) @ gpac.Frame((0, 0, 0.2))).position)
    with robots.load("ur5e", clock="virtual", tool="two_finger").system as cell:
        assert "ur5e.elbow" in cell.devices


def test_a_model_of_several_files_needs_a_place_and_one_of_one_file_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "taken").write_text("a file")
    monkeypatch.setenv("OPENGPAC_COMPILED", str(tmp_path / "taken"))
    robots.load("ur5e", clock="virtual").system.close()
    with pytest.raises(gpac.ModuleError, match=r"models cannot be stored in '.*/taken/models': .*; set OPENGPAC_COMPILED"):
        robots.load("ur5e", clock="virtual", tool="two_finger")
    with pytest.raises(gpac.ModuleError, match=r"'arm.xml' cannot be stored in '.*/taken/gone': .*; free up space there"):
        keep(tmp_path / "taken" / "gone" / "arm.xml", b"<mujoco/>")


def test_a_tool_without_a_tip_leaves_the_flange(tmp_path: Path) -> None:
    arm = robots.load("ur5e", clock="virtual", tool=written(tmp_path, "pin.xml", TOOL.replace("tcp", "other")))
    with arm.system:
        assert np.allclose(arm.tool.position, [0.0, 0.0, 0.0])


def test_a_model_that_mujoco_does_not_survive_is_refused_and_everything_goes_on(tmp_path: Path) -> None:
    """Sizes too large for memory crash the process in which MuJoCo reads them, which is not this one."""
    file = written(tmp_path, "arm.xml", TWO_ARMS.replace("<worldbody>", '<size nuser_body="2000000000"/><worldbody>'))
    with gpac.System("goes-on", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        rtp.timer("fast", period="1 ms", priority=80)
        for load in (lambda: robots.load(file, rtp), lambda: robots.Kinematics.of_mjcf(file, ["turn", "reach"])):
            with pytest.raises(gpac.DeviceFailed, match=r"arm\.xml': MuJoCo ends the process that tries to load it .*bad_alloc.*for sizes"):
                load()
        written(tmp_path, "arm.xml", TWO_ARMS)
        arm = robots.load(file, rtp)
        arm.enable()
        cell.advance("10 ms")
        assert arm.turn.state == "standstill", "the mended file is tried again, under its name"
