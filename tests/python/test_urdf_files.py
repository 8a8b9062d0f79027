# SPDX-License-Identifier: Apache-2.0
"""URDF files as found in the field: corrections with their notes, and refusals."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import robots
from opengpac.robots import urdf

ARM = """<robot name="arm">
<link name="base"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>{limit}</joint>
<link name="upper">{inertial}{shape}</link>
{more}
</robot>"""
LIMIT = '<limit lower="-2" upper="2" effort="100" velocity="2"/>'
INERTIAL = (
    '<inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>'
)
BOX = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
CUBE_OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
MORE = (
    '<joint name="{name}" type="{kind}"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>'
    '<limit lower="-1" upper="1" effort="50" velocity="1"/>{inside}</joint><link name="fore">' + INERTIAL + "</link>"
)


def arm(folder: Path, *, limit: str = LIMIT, inertial: str = INERTIAL, shape: str = "", more: str = "", name: str = "arm.urdf") -> Path:
    """Writes a URDF file of one revolute joint, with these parts."""
    file = folder / name
    file.write_text(ARM.format(limit=limit, inertial=inertial, shape=shape, more=more))
    return file


PUT_RIGHT = {
    "no inertia, no shape": ({"inertial": ""}, r"arm.urdf:4: link 'upper' has neither an inertia nor a shape"),
    "no mass": (
        {"inertial": '<inertial><mass value="0"/></inertial>', "shape": BOX},
        r"arm.urdf:4: link 'upper' has a mass of 0 kg; the mass is computed from its shapes instead",
    ),
    "an impossible inertia": (
        {"inertial": '<inertial><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'},
        r"link 'upper' has a physically impossible inertia; that of a ball of 5 cm",
    ),
    "an empty range": (
        {"limit": '<limit lower="2" upper="-2" effort="100" velocity="2"/>'},
        r"arm.urdf:3: the range of joint 'turn', 2 to -2, is empty",
    ),
    "no range": ({"limit": '<limit effort="100" velocity="2"/>'}, r"revolute joint 'turn' has no range"),
    "limits that are all zero": (
        {"limit": '<limit lower="0" upper="0" effort="0" velocity="0"/>'},
        r"arm.urdf:3: revolute joint 'turn' has no range",
    ),
    "no limit": ({"limit": ""}, r"arm.urdf:3: revolute joint 'turn' has no limit"),
    "no effort": ({"limit": '<limit lower="-2" upper="2" effort="0" velocity="2"/>'}, r"joint 'turn' has no effort limit"),
    "a mesh that is not there": ({"shape": MESH.format("package://maker/meshes/gone.stl")}, r"gone.stl' was not found and is ignored"),
    "a mesh that is none": ({"shape": MESH.format("odd.obj")}, r"odd.*ignored"),
    "a shape that is none": (
        {"shape": "<visual><geometry/></visual>"},
        r"arm.urdf:4: a <visual> of link 'upper' has no shape and is ignored; use one of box,",
    ),
    "two shapes in one": (
        {"shape": '<visual><geometry><sphere radius="0.01"/><sphere radius="0.02"/></geometry></visual>'},
        r"arm.urdf:4: a <geometry> has a <sphere> after its <sphere>; the first is used",
    ),
    "a part twice": (
        {"limit": LIMIT + LIMIT},
        r"arm.urdf:3: <joint> 'turn' has two <limit>; the first is used",
    ),
    "a range without end": (
        {"limit": LIMIT.replace('upper="2"', 'upper="99999999999"')},
        r"arm.urdf:3: the range of joint 'turn' is -2 to 1e\+11; it is treated as unlimited",
    ),
    "an infinite range": (
        {"limit": LIMIT.replace('upper="2"', 'upper="inf"')},
        r"arm.urdf:3: the range of joint 'turn' is -2 to inf; it is treated as unlimited",
    ),
    "an effort that is no limit": (
        {"limit": LIMIT.replace('effort="100"', 'effort="1e30"')},
        r"arm.urdf:3: joint 'turn' has an effort limit of 1e\+30; the effort of its motor is unlimited",
    ),
    "a speed that no joint has": (
        {"limit": LIMIT.replace('velocity="2"', 'velocity="1e-30"')},
        r"arm.urdf:3: joint 'turn' has an implausible maximum speed of 1e-30; it is ignored",
    ),
    "a damping below zero": (
        {"limit": LIMIT + '<dynamics damping="-1"/>'},
        r"arm.urdf:3: joint 'turn' has a damping of -1; its absolute value is used",
    ),
    "a friction below zero": (
        {"limit": LIMIT + '<dynamics friction="-1"/>'},
        r"arm.urdf:3: joint 'turn' has a friction of -1; its absolute value is used",
    ),
    "a radius below zero": (
        {"shape": BOX.replace('<box size="0.1 0.1 0.1"/>', '<sphere radius="-0.1"/>')},
        r"""arm.urdf:4: a <collision> of link 'upper' is ignored: its <sphere> has radius="-0.1", but a size must be above 0""",
    ),
    "no radius": (
        {"shape": BOX.replace('<box size="0.1 0.1 0.1"/>', "<sphere/>")},
        r"arm.urdf:4: a <collision> of link 'upper' is ignored: its <sphere> has no radius",
    ),
    "commas": (
        {"inertial": INERTIAL.replace('xyz="0.2 0 0"', 'xyz="0.2, 0, 0"')},
        r"""arm.urdf:4: xyz="0.2, 0, 0" of <origin> of link 'upper' separates its numbers by commas""",
    ),
    "a number too many": (
        {"inertial": INERTIAL.replace('xyz="0.2 0 0"', 'xyz="0.2 0 0 1"')},
        r"""arm.urdf:4: xyz="0.2 0 0 1" of <origin> of link 'upper' has 4 numbers; the first 3 are used""",
    ),
    "one scale": (
        {"shape": MESH.format("cube.obj").replace('"/>', '" scale="0.1"/>')},
        r"""arm.urdf:4: scale="0.1" of <mesh> of link 'upper' has one number, which is used for all directions""",
    ),
    "a follower of nobody": (
        {"more": MORE.format(name="fold", kind="revolute", inside='<mimic joint="gone"/>')},
        r"arm.urdf:5: joint 'fold' mimics joint 'gone', which is not in the file; it is fixed",
    ),
    "one name twice": (
        {"more": MORE.format(name="turn", kind="revolute", inside="")},
        r"arm.urdf:5: a second joint 'turn' is renamed 'turn_2'",
    ),
}


@pytest.mark.parametrize("kind", PUT_RIGHT)
def test_what_no_arm_can_have_is_put_right_and_told(tmp_path: Path, kind: str) -> None:
    parts, note = PUT_RIGHT[kind]
    (tmp_path / "odd.obj").write_text("v 0 0 0\n")
    (tmp_path / "cube.obj").write_text(CUBE_OBJ)
    file = arm(tmp_path, **parts)
    converted = urdf.convert(file)
    assert any(re.search(note, told) for told in converted.notes), converted.notes
    with pytest.warns(UserWarning, match=note):
        loaded = robots.load(file, clock="virtual", name="put-right")
    with loaded.system:
        assert loaded.notes == converted.notes
        loaded.enable()
        goal = [0.1] * len(loaded)
        assert np.allclose(gpac.motion.move_absolute(loaded, goal, time_limit="20 s").position, goal, atol=1e-3)
    with pytest.raises(gpac.DeviceFailed, match=r"has . defects?: .*" + note):
        robots.load(file, clock="virtual", strict=True)


WHOLE = ARM.format(limit=LIMIT, inertial=INERTIAL, shape="", more="")
TWO = ARM.format(limit=LIMIT, inertial=INERTIAL, shape="", more=MORE.format(name="fold", kind="revolute", inside=""))
THIRD = '<joint name="third" type="revolute"><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/>' + LIMIT + "</joint></robot>"
REFUSED = {
    "no XML": ("<robot", r"arm.urdf:1: the file is not valid XML: unclosed token"),
    "another root": ("<sdf/>", r"begins with <sdf>, not with <robot>"),
    "an unknown link": (
        WHOLE.replace('child link="upper"', 'child link="uper"'),
        r"arm.urdf:3: the child link of joint 'turn', 'uper', is not in the file",
    ),
    "a number that is none": (
        WHOLE.replace('velocity="2"', 'velocity="fast"'),
        r"""arm.urdf:3: velocity="fast" of <limit> of joint 'turn' is not a number; write a number there""",
    ),
    "no number": (
        WHOLE.replace('effort="100"', 'effort="nan"'),
        r"""arm.urdf:3: effort="nan" of <limit> of joint 'turn' is not a number""",
    ),
    "a mass that nothing has": (
        WHOLE.replace('mass value="2"', 'mass value="1e30"'),
        r"""arm.urdf:4: value="1e30" of <mass> of link 'upper' is above 1,000,000 kg, which is not plausible; check its unit""",
    ),
    "an inertia that nothing has": (
        WHOLE.replace('ixx="0.01"', 'ixx="1e30"'),
        r"""ixx="1e30" of <inertia> of link 'upper' is above 1,000""",
    ),
    "a place that nothing has": (
        WHOLE.replace('xyz="0.2 0 0"', 'xyz="0.2 0 inf"'),
        r"""arm.urdf:4: xyz="0.2 0 inf" of <origin> of link 'upper' is not 3 numbers; write 3 numbers there""",
    ),
    "a mimic of itself": (
        WHOLE.replace(LIMIT, LIMIT + '<mimic joint="turn"/>'),
        r"arm.urdf:3: joint 'turn' mimics itself; name the joint that it follows, or remove <mimic>",
    ),
    "a circle of mimics": (
        TWO.replace(LIMIT, LIMIT + '<mimic joint="fold"/>').replace('effort="50" velocity="1"/>', 'effort="50"/><mimic joint="turn"/>'),
        r"arm.urdf:3: joints 'turn', 'fold' mimic each other; remove the <mimic> of one of them",
    ),
    "two parents": (
        TWO.replace("</robot>", THIRD.format("base", "fore")),
        r"arm.urdf:6: link 'fore' is the child of two joints, 'fold' \(line 5\) and 'third', but links must form a tree; remove",
    ),
    "a circle": (
        TWO.replace("</robot>", THIRD.format("fore", "base")),
        r"arm.urdf:3: joints 'turn', 'third', 'fold' form a cycle: none of their links is connected to the base; remove one of them",
    ),
    "a link on itself": (
        TWO.replace('parent link="upper"', 'parent link="fore"'),
        r"arm.urdf:5: joint 'fold' joins link 'fore' to itself; set its parent to the link to which it is attached",
    ),
    "an axis of no length": (WHOLE.replace("0 1 0", "0 0 0", 1), r"the axis of joint 'turn' is 0 0 0"),
    "an unknown kind": (WHOLE.replace("revolute", "hinge"), r"joint 'turn' has the unknown type 'hinge'"),
    "two links of a name": (WHOLE.replace("</robot>", '<link name="upper"/></robot>'), r"two links are named 'upper'"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_has_no_meaning_is_refused_with_its_place(tmp_path: Path, kind: str) -> None:
    text, problem = REFUSED[kind]
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(gpac.DeviceFailed, match=problem):
        robots.load(tmp_path / "arm.urdf", clock="virtual")


def test_a_follower_of_a_fixed_joint_stands_where_that_puts_it(tmp_path: Path) -> None:
    """The range of the elbow holds it at 0.5 rad, and its follower at twice that; MuJoCo would let the follower swing."""
    follower = (
        '<joint name="tip" type="revolute"><parent link="fore"/><child link="hand"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>'
        '<mimic joint="fold" multiplier="2" offset="0.25"/>' + LIMIT + '</joint><link name="hand">' + INERTIAL + "</link>"
    )
    more = MORE.format(name="fold", kind="revolute", inside="").replace('lower="-1" upper="1"', 'lower="0.5" upper="0.5"') + follower
    with pytest.warns(UserWarning, match=r"joint 'tip' mimics 'fold', which is fixed; it is fixed at 1.25"):
        loaded = robots.load(arm(tmp_path, more=more), clock="virtual", name="held")
    with loaded.system:
        assert [joint.short_name for joint in loaded] == ["turn"]
        half = (0.5 + 1.25) / 2.0
        flange = [0.4 + 0.4 * np.cos(0.5), 0.0, -0.4 * np.sin(0.5), np.cos(half), 0.0, np.sin(half), 0.0]
        assert np.allclose([*loaded.forward([0.0])], flange, atol=1e-6)


@pytest.mark.parametrize("before", ["\n", "<!-- exported -->\n"])
def test_a_declaration_that_does_not_come_first_and_a_zero_at_the_end_are_no_obstacle(tmp_path: Path, before: str) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(f'{before}<?xml version="1.0"?>\n{WHOLE}\0')
    assert urdf.convert(file).notes == ()
    file.write_text(file.read_text().replace('effort="100"', 'effort="much"'))
    with pytest.raises(gpac.DeviceFailed, match=r"arm.urdf:5: effort"):
        urdf.convert(file)


def test_prefixes_that_nobody_declared_and_plugins_are_no_obstacle(tmp_path: Path) -> None:
    file = arm(tmp_path, more='<gazebo><plugin:thing sensor:x="1"/></gazebo><transmission name="t"><type>simple</type></transmission>')
    assert urdf.convert(file).notes == ()


@pytest.mark.parametrize("way", ["above", "package.xml", "package_paths", "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"])
def test_packages_are_found_where_everybody_looks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    package = {
        "above": tmp_path / "maker",
        "package.xml": tmp_path / "checked_out",
        "package_paths": tmp_path / "elsewhere" / "maker",
        "ROS_PACKAGE_PATH": tmp_path / "ros" / "maker",
        "AMENT_PREFIX_PATH": tmp_path / "install" / "share" / "maker",
    }[way]
    (package / "meshes").mkdir(parents=True)
    (package / "meshes" / "cube.obj").write_text(CUBE_OBJ)
    (package / "package.xml").write_text("<package><name>maker</name></package>")
    monkeypatch.setenv(way, str(package.parents[1] if way == "AMENT_PREFIX_PATH" else package.parent)) if way.isupper() else None
    home = package / "urdf" if way in ("above", "package.xml") else tmp_path / "robot"
    home.mkdir()
    file = arm(home, shape=MESH.format("package://maker/meshes/cube.obj"))
    converted = urdf.convert(file, [package.parent] if way == "package_paths" else [])
    assert converted.notes == () and "cube.obj" in converted.text


def test_a_relative_path_may_count_from_the_folder_of_the_package(tmp_path: Path) -> None:
    for folder in ("meshes", "urdf"):
        (tmp_path / folder).mkdir()
    (tmp_path / "meshes" / "cube.obj").write_text(CUBE_OBJ)
    converted = urdf.convert(arm(tmp_path / "urdf", shape=MESH.format("meshes/cube.obj")))
    assert converted.notes == () and "cube.obj" in converted.text
    converted = urdf.convert(arm(tmp_path / "urdf", shape=MESH.format("meshes/gone.obj")))
    assert "gone.obj' was not found" in converted.notes[0]


def test_a_joint_that_mimics_another_follows_it_and_is_no_joint_of_the_arm(tmp_path: Path) -> None:
    more = MORE.format(name="fold", kind="revolute", inside='<mimic joint="turn" multiplier="-0.5"/>')
    loaded = robots.load(arm(tmp_path, more=more), clock="virtual", name="mimic")
    with loaded.system:
        assert [joint.short_name for joint in loaded] == ["turn"]
        loaded.enable()
        gpac.motion.move_absolute(loaded, [1.0], time_limit="20 s")
        assert abs(loaded.turn.sensed.value - 1.0) < 0.01


def test_an_inertia_that_rounding_made_impossible_is_taken(tmp_path: Path) -> None:
    """A + B is less than C in the last digit."""
    thin = INERTIAL.replace('ixx="0.01" iyy="0.03" izz="0.03"', 'ixx="0.01" iyy="0.02" izz="0.030001"')
    loaded = robots.load(arm(tmp_path, inertial=thin), clock="virtual", name="thin")
    with loaded.system:
        assert loaded.notes == () and loaded.enable().turn.state == "standstill"


@pytest.mark.parametrize(
    ("bound", "absent", "ends"),
    [('lower="-1"', "upper", (-1.0, 0.0)), ('upper="1.5"', "lower", (0.0, 1.5)), ('lower="1"', "upper", (0.0, 1.0))],
)
def test_a_range_of_one_bound_has_the_other_at_zero(tmp_path: Path, bound: str, absent: str, ends: tuple[float, float]) -> None:
    file = arm(tmp_path, limit=f'<limit {bound} effort="100" velocity="2"/>')
    said = rf"arm.urdf:3: joint 'turn' has no {absent} limit, for which URDF specifies 0: its range is "
    with pytest.warns(UserWarning, match=said):
        loaded = robots.load(file, clock="virtual", name="one-bound")
    with loaded.system:
        (turn,) = loaded.enable()
        assert (turn.position_min, turn.position_max) == ends
        middle = sum(ends) / 2
        assert gpac.motion.move_absolute(turn, middle, time_limit="20 s").position == pytest.approx(middle, abs=1e-3)
        with pytest.raises(gpac.OutOfRange, match=f"its range is {ends[0]:g} to {ends[1]:g} rad"):
            gpac.motion.move_absolute(turn, ends[1] + 0.5)
    with pytest.raises(gpac.DeviceFailed, match=r"has . defects?: .*" + said):
        robots.load(file, clock="virtual", strict=True)


def test_a_continuous_joint_has_no_range(tmp_path: Path) -> None:
    file = arm(tmp_path)
    file.write_text(file.read_text().replace('type="revolute"', 'type="continuous"'))
    loaded = robots.load(file, clock="virtual", name="continuous")
    with loaded.system:
        (turn,) = loaded.enable()
        assert gpac.motion.move_absolute(turn, 7.0, time_limit="60 s").position == pytest.approx(7.0, abs=1e-3)
    file.write_text(file.read_text().replace('upper="2"', 'upper="99999999"'))
    (note,) = urdf.convert(file).notes
    assert note == "arm.urdf:3: the range of continuous joint 'turn', -2 to 1e+08, is ignored"


def test_a_fixed_range_is_a_fixed_joint(tmp_path: Path) -> None:
    more = MORE.format(name="fold", kind="revolute", inside="").replace('lower="-1" upper="1"', 'lower="0" upper="0"')
    with pytest.warns(UserWarning, match=r"the range of joint 'fold' is 0 to 0; the joint is fixed there"):
        loaded = robots.load(arm(tmp_path, more=more), clock="virtual", name="fixed")
    with loaded.system:
        assert [joint.short_name for joint in loaded] == ["turn"]


@pytest.mark.parametrize("kind", ["its range", "its type", "no joint"])
def test_a_robot_without_a_joint_that_moves_is_refused_with_the_reason(tmp_path: Path, kind: str) -> None:
    file = arm(tmp_path, limit='<limit lower="0.5" upper="0.5" effort="100" velocity="2"/>')
    text, problem = {
        "its range": (
            file.read_text(),
            r"arm.urdf:3: no joint of the robot can move: arm.urdf:3: the range of joint 'turn' is 0.5 to 0.5; the joint is fixed there",
        ),
        "its type": (file.read_text().replace("revolute", "fixed"), r"arm.urdf:3: no joint of the robot can move: 'turn' is fixed"),
        "no joint": ('<robot name="arm"><link name="base"/></robot>', r"arm.urdf:1: the robot has no joints"),
    }[kind]
    file.write_text(text)
    with pytest.raises(gpac.DeviceFailed, match=problem):
        robots.load(file, clock="virtual")


def test_a_range_without_zero_begins_at_its_nearest_end(tmp_path: Path) -> None:
    loaded = robots.load(arm(tmp_path, limit='<limit lower="0.5" upper="2" effort="100" velocity="2"/>'), clock="virtual", name="inside")
    with loaded.system:
        loaded.enable()
        assert loaded.values("home") == [0.5] and abs(loaded.turn.sensed.value - 0.5) < 1e-6


def test_links_of_an_arm_do_not_collide_with_each_other(tmp_path: Path) -> None:
    """The shapes of three links overlap, as convex hulls of real ones do."""
    big = '<collision><geometry><box size="0.9 0.2 0.2"/></geometry></collision>'
    more = MORE.format(name="fold", kind="revolute", inside="").replace("</link>", f"{big}</link>") + (
        '<joint name="twist" type="revolute"><parent link="fore"/><child link="hand"/><axis xyz="0 0 1"/>' + LIMIT + "</joint>"
        '<link name="hand">' + INERTIAL + big + "</link>"
    )
    loaded = robots.load(arm(tmp_path, shape=big, more=more), clock="virtual", name="touching")
    with loaded.system:
        loaded.enable()
        assert np.allclose(gpac.motion.move_absolute(loaded, [0.3, 0.3, 0.3], time_limit="20 s").position, 0.3, atol=1e-3)


def test_an_arm_collides_with_what_stands_around_it(tmp_path: Path) -> None:
    wall = tmp_path / "wall.xml"
    wall.write_text(
        '<mujoco><compiler angle="radian"/><worldbody><geom type="box" size="0.1 1 0.1" pos="0.4 0 -0.3"/></worldbody></mujoco>'
    )
    shape = '<collision><origin xyz="0.4 0 0"/><geometry><sphere radius="0.05"/></geometry></collision>'
    loaded = robots.load(arm(tmp_path, shape=shape), clock="virtual", name="wall", scene=wall)
    with loaded.system:
        loaded.enable()
        with pytest.raises(gpac.Terminated):
            gpac.motion.move_absolute(loaded, [1.5], time_limit="20 s")
        assert loaded.turn.sensed.value < 0.8, "the wall is in the way"
