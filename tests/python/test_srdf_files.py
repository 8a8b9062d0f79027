# SPDX-License-Identifier: Apache-2.0
"""SRDF files and `ros2_control` tags of URDF files: groups, states, passive joints, pairs that do not collide, interfaces and limits.

The complete robots are those of example-robot-data, with their makers' SRDF files.
"""

from __future__ import annotations

import logging
import re
import sys
import warnings
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

import opengpac as gpac
from opengpac import robots
from opengpac.robots import urdf
from opengpac.robots.urdf import packages

ROBOTS = Path(str(metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots")))
PANDA = ROBOTS / "panda_description/urdf/panda.urdf"
XARM = ROBOTS / "xarm_description/urdf/xarm7.urdf"

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>'
    '<limit lower="-2" upper="2" effort="50" velocity="2"/>{4}</joint><link name="{3}">' + INERTIAL + "{5}</link>\n"
)
SHAPE = '<collision><origin xyz="0 0 0.1"/><geometry><box size="0.05 0.05 0.15"/></geometry></collision>'
BODY = (
    '<robot name="two"><link name="base"/>\n'
    + JOINT.format("waist", "revolute", "base", "trunk", "", "")
    + JOINT.format("left_a", "revolute", "trunk", "left_upper", "", SHAPE)
    + JOINT.format("left_b", "revolute", "left_upper", "left_lower", "", SHAPE)
    + JOINT.format("left_finger", "revolute", "left_lower", "left_pad", "", "")
    + JOINT.format("left_thumb", "revolute", "left_lower", "left_tip", '<mimic joint="left_finger" multiplier="-1"/>', "")
    + JOINT.format("right_a", "revolute", "trunk", "right_upper", "", "")
    + JOINT.format("right_b", "revolute", "right_upper", "right_lower", '<mimic joint="right_a" multiplier="0.5" offset="0.1"/>', "")
    + JOINT.format("caster", "continuous", "base", "wheel", "", "")
    + "{}</robot>"
)
SEMANTICS = """<robot name="two">
<virtual_joint name="world_joint" type="fixed" parent_frame="world" child_link="base"/>
<group name="left"><chain base_link="trunk" tip_link="left_lower"/></group>
<group name="hand"><link name="left_pad"/></group>
<group name="right"><joint name="right_a"/><joint name="right_b"/></group>
<group name="both"><group name="left"/><group name="right"/></group>
<end_effector name="gripper" parent_link="left_lower" group="hand" parent_group="left"/>
<group_state name="home" group="left"><joint name="left_a" value="0.5"/><joint name="left_b" value="-1"/>
<joint name="waist" value="0.3"/></group_state>
<group_state name="home" group="hand"><joint name="left_finger" value="0.2"/></group_state>
<group_state name="up" group="both"><joint name="left_a" value="0"/><joint name="right_a" value="1"/></group_state>
<passive_joint name="caster"/><passive_joint name="world_joint"/>
<disable_collisions link1="left_upper" link2="left_lower" reason="Adjacent"/>
<disable_collisions link1="left_lower" link2="left_upper" reason="Never"/>
</robot>"""


@pytest.fixture
def body(tmp_path: Path) -> Path:
    """Returns a trunk with two arms, a hand and a caster, with its SRDF file beside it."""
    (tmp_path / "two.srdf").write_text(SEMANTICS)
    file = tmp_path / "two.urdf"
    file.write_text(BODY.format(""))
    return file


@pytest.fixture
def quiet() -> Iterator[None]:
    """Silences the notes about corrected files of example-robot-data, which these tests do not concern."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def names(arm: robots.Arm) -> list[str]:
    return [joint.short_name for joint in arm]


def test_without_a_group_all_joints_but_passive_and_following_ones_make_the_arm(body: Path) -> None:
    arm = robots.load(body, clock="virtual")
    with arm.system:
        assert names(arm) == ["waist", "left_a", "left_b", "left_finger", "right_a"]
        assert {group: [*joints] for group, joints in arm.groups.items()} == {
            "left": ["left_a", "left_b"],
            "hand": ["left_finger"],
            "right": ["right_a", "right_b"],
            "both": ["left_a", "left_b", "right_a", "right_b"],
        }
        assert arm.values("home") == [0.3, 0.5, -1.0, 0.2, 0.0], "the states of one name are one"
        assert arm.states["up"] == {"left_a": 0.0, "right_a": 1.0}
        arm.enable()
        arm.system.advance("500 ms")
        assert np.allclose(arm.values("sensed"), arm.values("home"), atol=1e-3)


def test_a_group_makes_the_arm_and_the_rest_stands_still_at_its_home(body: Path) -> None:
    arm = robots.load(body, clock="virtual", group="left")
    with arm.system:
        assert names(arm) == ["left_a", "left_b"] and arm.values("home") == [0.5, -1.0]
        assert {*arm.system.physical_devices["two"].parts} == {"left_a", "left_b", "left_finger"}, "the hand of the arm has its motor"
        arm.enable()
        assert np.allclose(gpac.motion.move_absolute(arm, [1.0, -0.5], time_limit="20 s").position, [1.0, -0.5], atol=1e-3)
        # The tip of the chain, with the waist at 0.3: links of 0.2 m about one axis.
        turned = 0.3 + np.cumsum([0.0, 1.0])
        expected = [0.2 * np.sin(turned).sum(), 0.0, 0.2 + 0.2 * np.cos(turned).sum()]
        assert np.allclose(arm.pose().position, expected, atol=2e-3), (arm.pose(), expected)


def test_a_part_of_a_robot_is_an_arm_with_a_pose_of_its_own(body: Path) -> None:
    robot = robots.load(body, clock="virtual")
    with robot.system:
        robot.enable()
        left = robot.part("left")
        assert names(left) == ["left_a", "left_b"] and left.states["home"] == {"left_a": 0.5, "left_b": -1.0}
        assert names(robot.part("right")) == ["right_a"], "a follower is no joint of it"
        gpac.motion.move_absolute(left, [1.0, -0.5], time_limit="20 s")
        assert np.allclose(robot.values("sensed"), [0.3, 1.0, -0.5, 0.2, 0.0], atol=1e-3), "the others stay"
        with pytest.raises(gpac.DefinitionError, match="joint 'waist' moves the tool but is not driven"):
            left.pose()
        whole = robot.part(["left_b", "waist", "left_a"])
        assert names(whole) == ["waist", "left_a", "left_b"]
        turned = np.cumsum([0.3, 1.0])
        assert np.allclose(whole.pose().position, [0.2 * np.sin(turned).sum(), 0.0, 0.2 + 0.2 * np.cos(turned).sum()], atol=2e-3)
        with pytest.raises(gpac.UnknownName, match="arm 'two' has no group 'lefty'; did you mean 'left'"):
            robot.part("lefty")
        with pytest.raises(gpac.UnknownName, match="has no device 'nose'"):
            robot.part(["nose"])


def test_a_robot_of_more_joints_than_a_motion_takes_says_so_and_moves_in_parts(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    count = 20
    links = "".join(JOINT.format(f"j{n}", "revolute", "base" if n % 10 == 0 else f"l{n - 1}", f"l{n}", "", "") for n in range(count))
    (tmp_path / "many.urdf").write_text(f'<robot name="many"><link name="base"/>{links}</robot>'.replace('effort="50"', 'effort="900"'))
    group = "".join(f'<joint name="j{n}"/>' for n in range(10))
    (tmp_path / "many.srdf").write_text(f'<robot name="many"><group name="left">{group}</group></robot>')
    robot = robots.load(tmp_path / "many.urdf", clock="virtual")
    with robot.system:
        assert "arm 'many' has 20 joints, but a motion can have at most 16: move parts of it, such as arm.part('left')" in caplog.text
        robot.enable()
        for part in (robot.part("left"), robot.part([f"j{n}" for n in range(10, count)])):
            assert np.allclose(gpac.motion.move_absolute(part, [0.1] * 10, time_limit="20 s").position, 0.1, atol=2e-3)
            assert len(part.pose().position) == 3


def test_a_follower_of_a_joint_that_stands_still_does_so_too(body: Path) -> None:
    still = urdf.convert(body, semantic=True, group="left").text
    joints = {joint.get("name") for joint in ElementTree.fromstring(still).iter("joint")}
    assert {"left_a", "left_b", "left_finger", "left_thumb", "caster"} <= joints
    assert not {"waist", "right_a", "right_b"} & joints
    right = urdf.convert(body, semantic=True, group="right")
    assert right.joints == {"right_a"}
    arm = robots.load(body, clock="virtual", group="right")
    with arm.system:
        assert names(arm) == ["right_a"] and arm.values("home") == [1.0], "'up' is the only state with one of its joints"


def test_links_collide_where_it_is_asked_for_but_for_the_pairs_of_the_srdf_file(body: Path) -> None:
    plain, asked = (
        mujoco.MjModel.from_xml_string(urdf.convert(body, semantic=True, self_collision=is_asked).text) for is_asked in (False, True)
    )
    assert {*plain.geom_conaffinity.tolist()} == {0} and {*asked.geom_conaffinity.tolist()} == {1}
    pair = sorted(asked.body(name).id for name in ("left_upper", "left_lower"))
    assert plain.nexclude == 0 and asked.exclude_signature.tolist() == [(pair[0] << 16) + pair[1]]


def test_an_arm_that_folds_onto_itself_is_stopped_where_links_collide(body: Path) -> None:
    long = SHAPE.replace("0 0 0.1", "0 0 0.2").replace("0.15", "0.38")
    text = body.read_text().replace('<link name="trunk">', f'<link name="trunk">{SHAPE}').replace('"-2"', '"-3.1"')
    body.write_text(text.replace(f'<link name="left_lower">{INERTIAL}{SHAPE}', f'<link name="left_lower">{INERTIAL}{long}'))
    body.with_suffix(".srdf").write_text(SEMANTICS.replace("disable_collisions", "collisions_that_are_not_read"))
    arm = robots.load(body, clock="virtual", group="left", self_collision=True)
    assert arm.notes == ()
    with arm.system:
        arm.enable()
        with pytest.raises(gpac.Terminated):
            gpac.motion.move_absolute(arm, [0.0, -3.1], time_limit="20 s")


def test_the_file_beside_is_told_in_the_log_and_one_of_several_has_to_be_named(body: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "opengpac")
    urdf.convert(body, semantic=True)
    assert re.search(r"'two.urdf': read the SRDF file beside it, '.*two.srdf', with the groups left, hand, right, both", caplog.text)
    (body.parent / "more.srdf").write_text(SEMANTICS)
    caplog.clear()
    assert urdf.convert(body, semantic=True).groups == {}
    assert (
        "none of the SRDF files beside it ('more.srdf', 'two.srdf') is read, because there are several; choose one with srdf="
        in caplog.text
    )
    assert urdf.convert(body, semantic=False).groups == {}
    with pytest.raises(gpac.UnknownName, match="there is no group 'left', because no SRDF file was read; pass its file: srdf="):
        robots.load(body, clock="virtual", group="left")
    with pytest.raises(gpac.UnknownName, match=r"two.srdf' has no group 'lefd'; did you mean 'left'"):
        robots.load(body, clock="virtual", group="lefd", srdf=body.parent / "two.srdf")


@pytest.mark.parametrize("named", [False, True])
def test_macros_of_an_srdf_file_are_expanded(body: Path, named: bool) -> None:
    (body.parent / "two.srdf").unlink()
    file = body.parent / "two.srdf.xacro"
    argument = '<xacro:arg xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm" default="left"/><group name="$(arg arm)">'
    file.write_text(SEMANTICS.replace('<group name="left">', argument))
    arm = robots.load(body, clock="virtual", name="expanded", group="left", **({"srdf": file} if named else {}))
    assert [joint.short_name for joint in arm] == ["left_a", "left_b"] and arm.values("home") == [0.5, -1.0]


def test_an_srdf_file_is_read_before_one_with_macros(body: Path) -> None:
    (body.parent / "two.srdf.xacro").write_text("<robot>$(arg arm)</robot>")
    assert urdf.convert(body, semantic=True).groups


def test_an_srdf_file_with_macros_needs_xacro_only_where_it_is_named(body: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xacro", None)
    file = (body.parent / "two.srdf").rename(body.parent / "two.srdf.xacro")
    converted = urdf.convert(body, semantic=True)
    assert converted.groups == {} and any("but xacro is not installed" in note for note in converted.notes)
    with pytest.raises(
        gpac.DeviceFailed, match=r"two\.srdf\.xacro' contains xacro macros, the first of them on line 1, but xacro is not inst"
    ):
        robots.load(body, clock="virtual", srdf=file)


DAMAGED = {
    "no XML": (SEMANTICS[:300], r"two.srdf:\d: the file is not valid XML"),
    "another root": ("<srdf/>", r"begins with <srdf>, not with <robot>; pass a SRDF file"),
    "a group without a name": (SEMANTICS.replace(' name="hand"', ""), r"two.srdf:4: a <group> has no name"),
    "a group twice": (SEMANTICS.replace('name="hand"', 'name="left"'), r"two.srdf:4: two groups are named 'left'"),
    "a group of itself": (
        SEMANTICS.replace('<group name="right"/>', '<group name="both"/>'),
        r"two.srdf:6: group 'both' contains itself",
    ),
    "half a chain": (SEMANTICS.replace('tip_link="left_lower"', ""), r"two.srdf:3: a chain of group 'left' lacks base_link or tip_link"),
    "an odd member": (
        SEMANTICS.replace('<link name="left_pad"/>', "<lnik/>"),
        r"two.srdf:4: group 'hand' cannot have a <lnik>; use only <joint> or",
    ),
    "a value that is none": (
        SEMANTICS.replace('"0.5"', '"half"'),
        r"two.srdf:8: the value of joint 'left_a' in state 'home' must be a number, not 'half'",
    ),
    "a value without end": (
        SEMANTICS.replace('"0.5"', '"nan"'),
        r"two.srdf:8: the value of joint 'left_a' in state 'home' must be a number, not 'nan'",
    ),
    "half a pair": (SEMANTICS.replace('link2="left_lower"', ""), r"two.srdf:13: a <disable_collisions> lacks link1 or link2"),
    "a passive joint without a name": (SEMANTICS.replace(' name="caster"', ""), r"two.srdf:12: a <passive_joint> has no name"),
}


@pytest.mark.parametrize("kind", DAMAGED)
def test_a_damaged_file_is_refused_with_its_place_or_left_out_where_nobody_named_it(body: Path, kind: str) -> None:
    text, problem = DAMAGED[kind]
    file = body.with_suffix(".srdf")
    file.write_text(text)
    with pytest.raises(gpac.DeviceFailed, match=problem):
        robots.load(body, clock="virtual", srdf=file)
    assert any(re.search(problem.partition("; ")[0], note) for note in urdf.convert(body, semantic=True).notes)


def test_names_that_the_urdf_file_lacks_are_left_out_with_one_note(body: Path) -> None:
    file = body.with_suffix(".srdf")
    file.write_text(
        SEMANTICS.replace('"right_a"', '"righd_a"')
        .replace('"left_pad"', '"pad"')
        .replace('<group name="left"/>', '<group name="lft"/>')
        .replace('group="hand">', 'group="hnd">')
    )
    assert urdf.convert(body, semantic=file).notes == (
        "two.srdf:6: group 'both' contains group 'lft', which is not in the file; it is ignored",
        "two.srdf:10: state 'home' belongs to group 'hnd', which is not in the file; it is used without a group",
        "two.srdf:4: link 'pad' is not in the URDF file, and neither are 1 other names in it; its entries are ignored",
    )
    with pytest.raises(gpac.DeviceFailed, match=r"two.srdf:4: group 'hand' has no joint that a motor drives"):
        robots.load(body, clock="virtual", srdf=file, group="hand")


def test_arms_without_a_urdf_file_of_their_own_take_no_srdf_file(body: Path) -> None:
    with pytest.raises(gpac.CallError, match=r"only the name, joints and home of .*panda.* are known"):
        robots.load("panda", clock="virtual", group="arm")
    with pytest.raises(gpac.CallError, match=r"ur5e.xml' is not a URDF file; omit srdf=, group= and self_collision="):
        robots.load("ur5e", clock="virtual", srdf=body.with_suffix(".srdf"))
    with pytest.raises(gpac.DeviceFailed, match=r"cannot read '.*none.srdf': No such file or directory; pass the path of a SRDF file"):
        robots.load(body, clock="virtual", srdf=body.with_name("none.srdf"))


CONTROL = """<ros2_control name="arms" type="system"><hardware><plugin>mock</plugin></hardware>
<joint name="left_a"><command_interface name="position"><param name="min">-1</param><param name="max">1.5</param></command_interface>
<command_interface name="velocity"><param name="min">-0.5</param><param name="max">0.5</param></command_interface>
<command_interface name="effort"><param name="max">20</param></command_interface>
<state_interface name="position"><param name="initial_value">0.25</param></state_interface><state_interface name="velocity"/></joint>
<joint name="left_b"><command_interface name="position"><param name="min">{}</param></command_interface></joint>
<joint name="lost"/>
</ros2_control>"""


def test_interfaces_and_limits_of_ros2_control_are_read(body: Path) -> None:
    body.write_text(BODY.format(CONTROL.format("-1.25")))
    with pytest.warns(UserWarning, match=r"two.urdf:\d+: joint 'lost' of <ros2_control name=\"arms\"> is not in the file"):
        arm = robots.load(body, clock="virtual", srdf=False)
    with arm.system:
        assert arm.interfaces["left_a"] == robots.Interfaces("arms", ("position", "velocity", "effort"), ("position", "velocity"))
        limits = {name: (joint.position_min, joint.position_max) for name, joint in zip(names(arm), arm, strict=True)}
        assert limits["left_a"] == (-1.0, 1.5) and limits["left_b"] == (-1.25, 2.0) and limits["waist"] == (-2.0, 2.0)
        left = arm["left_a"]
        assert (left.max_speed, left.max_effort, left.home) == (0.5, 20.0, 0.25)


@pytest.mark.parametrize(
    ("value", "note"),
    [
        ("fast", r"two.urdf:\d+: 'min' of the interface 'position' of joint 'left_b' is 'fast', which is not a number"),
        ("3", r"<ros2_control> gives joint 'left_b' the range 3 to inf, which does not overlap with its limit, -2 to 2"),
    ],
)
def test_odd_limits_of_ros2_control_are_left_out_with_a_note(body: Path, value: str, note: str) -> None:
    body.write_text(BODY.format(CONTROL.format(value)))
    with pytest.warns(UserWarning, match=note):
        arm = robots.load(body, clock="virtual", srdf=False)
    with arm.system:
        assert (arm["left_b"].position_min, arm["left_b"].position_max) == (-2.0, 2.0)


WHOLE: dict[str, dict[str, Any]] = {
    "panda": {"file": PANDA, "group": "arm", "joints": [f"panda_joint{n}" for n in range(1, 8)], "home": -2.35619, "states": {"default"}},
    "xarm7": {"file": XARM, "group": "xarm7", "joints": [f"joint{n}" for n in range(1, 8)], "home": 0.0, "states": {"home", "hold-up"}},
    "talos": {
        "file": ROBOTS / "talos_data/robots/talos_full_v2.urdf",
        "group": "l_arm",
        "joints": [f"arm_left_{n}_joint" for n in range(1, 8)],
        "home": -0.525366,
        "states": {"half_sitting"},
    },
    "pr2": {
        "file": ROBOTS / "pr2_description/urdf/pr2.urdf",
        "srdf": ROBOTS / "pr2_description/srdf/pr2.srdf",
        "group": "left_arm",
        "joints": [
            f"l_{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex", "forearm_roll", "wrist_flex")
        ]
        + ["l_wrist_roll_joint"],
        "home": -1.68339,
        "states": {"tuck_left_arm"},
    },
}  # fmt: skip
"""Robots with SRDF files by their makers; `home` is the position of the fourth joint."""


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize("name", WHOLE)
def test_a_group_of_a_whole_robot_holds_at_its_state_and_moves(name: str) -> None:
    robot = WHOLE[name]
    arm = robots.load(robot["file"], clock="virtual", name=name, group=robot["group"], srdf=robot.get("srdf", True))
    with arm.system:
        assert names(arm) == robot["joints"] and {*arm.states} == robot["states"]
        assert arm.values("home")[3] == pytest.approx(robot["home"], abs=1e-5)
        arm.enable()
        arm.system.advance("500 ms")
        home, most = np.array(arm.values("home")), np.array(arm.values("position_max"))
        assert np.allclose(arm.values("sensed"), home, atol=1e-3)
        goal = np.where(home + 0.1 <= most, home + 0.1, home - 0.1)
        gpac.motion.move_absolute(arm, goal.tolist(), time_limit="20 s")
        arm.system.advance("500 ms")
        assert np.allclose(arm.values("sensed"), goal, atol=1e-3)
        assert arm.pose() is not None and len(arm.kinematics.joints) == len(arm)


@pytest.mark.usefixtures("quiet")
def test_every_srdf_file_of_the_package_is_read() -> None:
    """Each is read beside the URDF files of its robot: no traceback, and groups if the file has some."""
    read = 0
    for file in sorted(ROBOTS.glob("*/srdf/*.srdf")):
        arms = [*sorted(file.parents[1].glob("*/*.urdf"))]
        for arm in arms[:1]:
            found = packages.Packages(arm)
            semantics = urdf.srdf.read(file, urdf.Source.read(arm, found), found)
            groups = {element.get("name") for element in ElementTree.parse(file).getroot().findall("group")}
            assert {*semantics.groups} == groups, file
            read += 1
    assert read >= 30
