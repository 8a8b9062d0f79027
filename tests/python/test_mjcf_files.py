# SPDX-License-Identifier: Apache-2.0
"""MJCF files as found in the field: defects that keep an arm from moving are corrected, with a note; all else is left unchanged."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.robots import mjcf

ARM = """<mujoco model="arm"><compiler angle="radian"{compiler}/>{assets}
<worldbody>
<body name="base" pos="0 0 0.5"><geom name="base" type="sphere" size="0.08"/>
<body name="upper"><joint name="shoulder" axis="0 0 1" range="-2 2"{joint}/>
<geom type="capsule" fromto="0.15 0 0 0.3 0 0" size="0.03" mass="2"/>{upper}
<body name="fore" pos="0.4 0 0"><joint name="elbow" axis="0 1 0" range="-2 2"/>
<geom type="capsule" fromto="0.05 0 0 0.2 0 0" size="0.03" mass="1"/>
<body name="hand" pos="0.25 0 0"><joint name="wrist" axis="0 0 1" range="-2 2"/>
<geom type="sphere" size="0.03" pos="{hand} 0 0" mass="0.2"/></body></body></body></body>
{world}</worldbody>{actuators}{more}</mujoco>"""
MOTORS = "<actuator>" + "".join(f'<motor joint="{j}" ctrlrange="-80 80"/>' for j in ("shoulder", "elbow", "wrist")) + "</actuator>"
REACHES_BACK = "-0.3"
"""The hand's shape is inside the upper arm: they are two joints apart, so MuJoCo lets them collide."""


def arm(folder: Path, *, hand: str = "0.05", actuators: str = MOTORS, **parts: str) -> Path:
    """Writes a model of three joints, with these parts."""
    file = folder / "arm.xml"
    given = {name: parts.get(name, "") for name in ("compiler", "assets", "joint", "upper", "world", "more")}
    file.write_text(ARM.format(hand=hand, actuators=actuators, **given))
    return file


def moved(file: Path, goal: list[float]) -> tuple[gpac.robots.Arm, float]:
    """Returns the arm of a file after a move, and its distance from the goal 0.2 s later, rad."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = gpac.robots.load(file, name=file.parent.name, clock="virtual").enable()
    gpac.motion.move_absolute(found, goal, time_limit="20 s")
    found.system.advance("0.2 s")
    return found, float(np.abs(np.array(found.values("sensed")) - goal).max())


def test_a_sound_file_is_used_as_it_is(tmp_path: Path) -> None:
    assert mjcf.put_right(arm(tmp_path)) == (None, (), frozenset())
    found, error = moved(arm(tmp_path), [0.5, 0.4, 0.3])
    assert found.notes == () and error < 1e-3


def test_links_that_touch_at_home_do_not_collide(tmp_path: Path) -> None:
    found, error = moved(arm(tmp_path, hand=REACHES_BACK), [0.5, 0.4, 0.3])
    assert found.notes == ("arm.xml: 'upper' and 'hand' touch at the arm's home, so their collisions are ignored",)
    assert error < 1e-3


def test_strict_refuses_such_a_file(tmp_path: Path) -> None:
    with pytest.raises(gpac.errors.DeviceFailed, match=r"the file has 1 defect: .*'upper' and 'hand' touch at the arm's home"):
        gpac.robots.load(arm(tmp_path, hand=REACHES_BACK), name="strict", clock="virtual", strict=True)


def test_what_the_arm_meets_on_its_way_stays_there(tmp_path: Path) -> None:
    stand = '<body name="stand"><geom type="sphere" size="0.03" pos="0 0.2 0.5"/></body>'
    assert mjcf.put_right(arm(tmp_path, world=stand)) == (None, (), frozenset())


def test_an_object_that_the_hand_touches_at_home_stays_in_its_way(tmp_path: Path) -> None:
    ball = '<body name="ball" pos="0.72 0 0.5"><freejoint/><geom type="sphere" size="0.03"/></body>'
    assert mjcf.put_right(arm(tmp_path, world=ball)) == (None, (), frozenset())


def test_a_file_without_actuators_gets_motors(tmp_path: Path) -> None:
    found, error = moved(arm(tmp_path, actuators=""), [0.5, 0.4, 0.3])
    assert "no actuator drives a joint, so motors are added: 'shoulder' " in found.notes[0] and "N.m, 'elbow' " in found.notes[0]
    # The elbow holds 1 kg at 0.125 m and 0.2 kg at 0.3 m: 1.8 N.m, plus the same reserve.
    assert error < 1e-3 and 3.6 < found["elbow"].max_effort < 10.0


def test_followers_and_locked_joints_get_no_motor(tmp_path: Path) -> None:
    follows = '<equality><joint joint1="wrist" joint2="elbow"/></equality>'
    _, notes, _ = mjcf.put_right(arm(tmp_path, actuators="", joint=' damping="1e9"', more=follows))
    assert notes[0] == "arm.xml: joint 'shoulder' is locked by its damping, so no motor is added"
    assert "'elbow'" in notes[1] and "'wrist'" not in notes[1]


def test_a_mocap_body_gives_way_to_the_motors(tmp_path: Path) -> None:
    lead = '<body name="lead" mocap="true" pos="0.7 0 0.5"/>'
    weld = '<equality><weld body1="lead" body2="hand"/></equality>'
    found, error = moved(arm(tmp_path, actuators="", world=lead, more=weld), [0.5, 0.4, 0.3])
    assert "'lead' and 'hand' by a mocap body" in found.notes[0] and error < 1e-3


def test_files_beside_the_model_are_found_from_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "skin.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    skin = {"assets": '<asset><mesh name="skin" file="skin.obj" scale="0.1 0.1 0.1"/></asset>', "compiler": ' meshdir="meshes"'}
    shape = '<geom type="mesh" mesh="skin" contype="0" conaffinity="0" mass="0.1"/>'
    found, error = moved(arm(tmp_path, actuators="", upper=shape, **skin), [0.2, 0.2, 0.2])
    assert len(found.notes) == 1 and error < 1e-3


SKINNED = """<mujoco><compiler angle="radian" meshdir="meshes"/><asset><mesh name="upper" file="{}"/></asset><worldbody>
<body name="upper"><joint name="turn" range="-1 1"/><inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>
<geom type="mesh" mesh="upper"/>
<body name="tip" pos="0 0 0.3"><joint name="bend" range="-1 1"/><geom type="mesh" mesh="upper"/></body></body>
</worldbody><actuator><motor joint="turn" ctrlrange="-50 50"/><motor joint="bend" ctrlrange="-50 50"/></actuator></mujoco>"""


@pytest.mark.parametrize("file", ["gone.stl", "odd.stl", "odd.obj"])
def test_an_arm_moves_without_a_mesh_that_is_not_there_or_damaged(tmp_path: Path, file: str) -> None:
    (tmp_path / "meshes").mkdir()
    for name in ("odd.stl", "odd.obj"):
        (tmp_path / "meshes" / name).write_bytes(b"no mesh" * 20)
    model = tmp_path / "arm.xml"
    model.write_text(SKINNED.format(file))
    with pytest.warns(UserWarning, match=rf"arm.xml: mesh '{file}' is ignored: "):
        arm = gpac.robots.load(model, clock="virtual", name="bare")
    with arm.system:
        gpac.motion.move_absolute(arm.enable(), [0.3, -0.3])
        assert arm.values("sensed") == pytest.approx([0.3, -0.3], abs=2e-3)
    with pytest.raises(gpac.DeviceFailed, match=rf"mesh '{file}' is ignored"):
        gpac.robots.load(model, clock="virtual", name="strict", strict=True)


@pytest.mark.parametrize(
    "text", ["", "<mujoco", "<mujoco><worldbody><body/></worldbody></mujoco>", '<mujoco><include file="none.xml"/></mujoco>']
)
def test_a_damaged_file_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "odd.xml"
    file.write_text(text)
    if not text.endswith(">"):
        with pytest.raises(gpac.DeviceFailed, match=r"odd\.xml:1: the file is not valid XML: "):
            mjcf.put_right(file)
    else:
        assert mjcf.put_right(file) == (None, (), frozenset())
    with pytest.raises(gpac.DeviceFailed, match=r"odd\.xml"):
        gpac.robots.load(file, name=file.parent.name, clock="virtual")


def test_friction_and_followers_keep_no_joint_off_its_goal(tmp_path: Path) -> None:
    file = arm(
        tmp_path,
        joint=' frictionloss="5" damping="2"',
        more='<equality><joint joint1="wrist" joint2="elbow" polycoef="0 1 0 0 0"/></equality>',
    )
    file.write_text(file.read_text().replace('<motor joint="wrist" ctrlrange="-80 80"/>', ""))
    _, error = moved(file, [0.5, 0.4])
    assert error < 1e-4


@pytest.mark.parametrize("friction", [40, 60])
def test_a_joint_that_friction_holds_throws_no_other_joint(tmp_path: Path, friction: int) -> None:
    """The shoulder has 80 N.m. The wrist was loaded as if the shoulder accelerated, although it stood still."""
    found, error = moved(arm(tmp_path, joint=f' frictionloss="{friction}"'), [0.5, 0.4, 0.3])
    assert error < 1e-3
    gpac.motion.move_absolute(found, [0.0, 0.0, 0.0], time_limit="20 s")
    wrist = found["wrist"]
    asked, sensed = (of.history[-2000:]["value"] for of in (wrist.reference, wrist.sensed))
    assert np.abs(asked - sensed).max() < 0.05


@pytest.mark.parametrize("friction", [5, 40])
def test_a_passive_joint_with_friction_pulls_no_other_joint_off_its_way(tmp_path: Path, friction: int) -> None:
    """The wrist has no motor, and friction bears its weight, at most 3 N.m: it moves along as if it were fixed."""
    file = arm(tmp_path, hand="0.15", actuators=MOTORS.replace('<motor joint="wrist" ctrlrange="-80 80"/>', ""))
    stiff = f'<joint name="wrist" axis="0 1 0" range="-2 2" frictionloss="{friction}"/>'
    text = file.read_text().replace('<joint name="wrist" axis="0 0 1" range="-2 2"/>', stiff).replace('mass="0.2"', 'mass="2"')
    file.write_text(text)
    found, error = moved(file, [0.5, 0.4])
    assert error < 1e-4
    asked, sensed = (of.history[-1000:]["value"] for of in (found["elbow"].reference, found["elbow"].sensed))
    assert np.abs(asked - sensed).max() < 1e-3


def test_friction_leaves_less_effort_for_accelerations(tmp_path: Path) -> None:
    def of(name: str, friction: int) -> float:
        (tmp_path / name).mkdir()
        file = arm(tmp_path / name, joint=f' frictionloss="{friction}"', actuators=MOTORS.replace("80", "2"))
        return gpac.robots.load(file, name=name, clock="virtual")["shoulder"].max_acceleration

    assert of("rough", 1) < 0.6 * of("smooth", 0)


def test_a_motor_that_is_too_weak_is_named_with_its_effort(tmp_path: Path) -> None:
    """The elbow needs 1.8 N.m for its weight alone; its servo exceeds its motor's effort only later."""
    weak = MOTORS.replace('"elbow" ctrlrange="-80 80"', '"elbow" ctrlrange="-1.5 1.5"')
    with pytest.warns(UserWarning, match="'elbow' sinks"):
        found = gpac.robots.load(arm(tmp_path, actuators=weak), name="weak", clock="virtual").enable()
    with pytest.raises(gpac.Terminated, match=r"joint 'weak\.elbow' is .*; its motor is at -1\.5 of 1\.5 N\.m \(saturated\)") as ended:
        gpac.motion.move_absolute(found, [0.5, -1.0, 0.3])
    assert "or give its motor more effort in the model" in str(ended.value)
    assert "its motor is at -1.5 of 1.5 N.m (saturated)" in found.system.alarms["following_error"].text


def test_a_message_names_what_a_joint_has_run_into(tmp_path: Path) -> None:
    wall = '<geom name="wall" type="box" size="0.2 0.05 0.4" pos="0.4 0.4 0.4"/>'
    found = gpac.robots.load(arm(tmp_path, world=wall), name="blocked", clock="virtual").enable()
    assert found.touching() == []
    with pytest.raises(gpac.Terminated, match=r"joint 'blocked\.\w+' is .* from its commanded position, .*; '(fore|hand)' touches 'wall'"):
        gpac.motion.move_absolute(found, [1.5, 0.0, 0.0], time_limit="20 s")
    assert {second for _, second in found.touching()} == {"wall"}


def test_the_floor_that_stops_an_arm_of_ours_is_named() -> None:
    found = gpac.robots.load("ur5e", name="falling", clock="virtual").enable()
    goal = found.values("sensed")
    goal[1] += 1.5
    with pytest.raises(gpac.Terminated, match=r"'following_error': .*; 'floor' touches '\w+_link'"):
        gpac.motion.move_absolute(found, goal, time_limit="20 s")


def test_what_an_arm_was_thrown_back_from_is_named() -> None:
    """At speed the wrist leaves the floor again before its joint is found too far from its commanded position."""
    found = gpac.robots.load("ur5e", name="thrown", clock="virtual").enable()
    goal = [position + 0.8 for position in found.values("sensed")]
    with pytest.raises(gpac.Terminated, match=r"'following_error': .*; at its commanded position, 'floor' collides with 'wrist_2_link'"):
        gpac.motion.move_absolute(found, goal, speed="80 %")
    assert found.touching() == []


def test_a_file_that_is_no_xml_is_refused_with_the_line(tmp_path: Path) -> None:
    file = arm(tmp_path)
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:5], lines[5].replace("</geom>", "").replace("/>", ">", 1), *lines[6:]]))
    with pytest.raises(
        gpac.DeviceFailed, match=r"arm.xml:\d+: the file is not valid XML: mismatched tag; pass the path of a MJCF or URDF file"
    ):
        gpac.robots.load(file, clock="virtual")


def test_a_limit_that_no_joint_takes_names_the_file(tmp_path: Path) -> None:
    file = arm(tmp_path, actuators=MOTORS)
    file.write_text(file.read_text().replace('axis="0 1 0" range="-2 2"', 'axis="0 1 0" range="-2 99999999999"'))
    with pytest.raises(gpac.DeviceFailed, match=r"arm.xml:\d+: range=\"-2 99999999999\" of joint 'elbow' is above 1,000,000,000, which"):
        gpac.robots.load(file, clock="virtual")


IMPLAUSIBLE = [
    ({"joint": ' armature="-1"'}, "armature=\"-1\" of joint 'shoulder' is below 0, which is not plausible"),
    ({"joint": ' frictionloss="inf"'}, "frictionloss=\"inf\" of joint 'shoulder' is not finite"),
    ({"joint": ' damping="nan"'}, "damping=\"nan\" of joint 'shoulder' is not finite"),
    (
        {"upper": '<inertial pos="0 0 0" mass="1e30" diaginertia="1 1 1"/>'},
        "mass=\"1e30\" of <inertial> of body 'upper' is above 1,000,000 kg, which is not plausible",
    ),
    ({"upper": '<site name="mark" pos="nan 0 0"/>'}, "pos=\"nan 0 0\" of site 'mark' is not finite"),
    ({"actuators": MOTORS.replace('joint="elbow"', 'joint="elbow" gear="1e9"')}, "is above 1,000,000, which is not plausible"),
]
"""MuJoCo accepts each, most without a warning."""


@pytest.mark.parametrize(("given", "said"), IMPLAUSIBLE)
def test_a_number_that_nothing_has_is_refused_with_its_line(tmp_path: Path, given: dict[str, str], said: str) -> None:
    file = arm(tmp_path, **given)
    with pytest.raises(gpac.DeviceFailed, match=rf"arm\.xml:\d+: .*{re.escape(said)}"):
        gpac.robots.load(file, clock="virtual")


def test_numbers_of_an_included_file_a_tool_and_a_scene_are_checked(tmp_path: Path) -> None:
    odd, file = tmp_path / "odd.xml", arm(tmp_path)
    odd.write_text('<mujoco><worldbody><body name="ball" pos="0 0 inf"><geom size="0.1"/></body></worldbody></mujoco>')
    said = r"odd.xml:1: pos=\"0 0 inf\" of body 'ball' is not finite; write a number there, or remove it"
    parts: list[dict[str, Any]] = [{"tool": odd}, {"scene": odd}]
    for part in parts:
        with pytest.raises(gpac.DeviceFailed, match=said):
            gpac.robots.load("ur5e", clock="virtual", **part)
    file.write_text(file.read_text().replace("<worldbody>", '<include file="odd.xml"/><worldbody>', 1))
    with pytest.raises(gpac.DeviceFailed, match=said):
        gpac.robots.load(file, clock="virtual")


def test_a_mass_that_follows_from_a_size_is_refused_with_its_body(tmp_path: Path) -> None:
    file = arm(tmp_path, upper='<geom type="sphere" size="9000"/>')
    with pytest.raises(gpac.DeviceFailed, match=r"arm.xml: body 'upper' has an invalid mass, 3\S+ kg"):
        gpac.robots.load(file, clock="virtual")


def test_a_motor_that_cannot_hold_the_arm_at_its_home_is_told_at_once(tmp_path: Path) -> None:
    """The elbow needs 1.8 N.m for its weight."""
    file = arm(tmp_path, actuators=MOTORS.replace('"elbow" ctrlrange="-80 80"', '"elbow" ctrlrange="-0.2 0.2" gear="-5"'))
    weak = r"arm\.xml: joint 'elbow' sinks: it needs 1\.8\d? N\.m at the arm's home, but its motor has only 1 N\.m"
    with pytest.warns(UserWarning, match=weak):
        found = gpac.robots.load(file, name="sinks", clock="virtual")
    assert found._scene == file, "nothing in the file is changed"
    with pytest.raises(gpac.DeviceFailed, match=weak):
        gpac.robots.load(file, name="strict", clock="virtual", strict=True)


def test_a_motor_that_cannot_overcome_the_friction_of_its_joint_is_told_at_once(tmp_path: Path) -> None:
    file = arm(
        tmp_path, joint=' frictionloss="2"', actuators=MOTORS.replace('"shoulder" ctrlrange="-80 80"', '"shoulder" ctrlrange="-2 2"')
    )
    said = r"arm\.xml: joint 'shoulder' cannot move: its dry friction is 2 N\.m, but its motor has only 2 N\.m; increase the effort"
    with pytest.warns(UserWarning, match=said):
        gpac.robots.load(file, name="stuck", clock="virtual")


def test_what_a_stop_carries_needs_no_motor(tmp_path: Path) -> None:
    file = arm(tmp_path, actuators=MOTORS.replace('"elbow" ctrlrange="-80 80"', '"elbow" ctrlrange="-1 1"'))
    file.write_text(file.read_text().replace('axis="0 1 0" range="-2 2"', 'axis="0 1 0" range="-2 0"'))
    assert mjcf.put_right(file) == (None, (), frozenset())


def test_motors_are_made_for_the_whole_range(tmp_path: Path) -> None:
    """At its home this arm hangs down; it needs its maximum effort when stretched out."""
    hangs = arm(tmp_path, actuators="")
    hangs.write_text(hangs.read_text().replace('<body name="fore" pos="0.4 0 0">', '<body name="fore" pos="0.4 0 0" euler="0 1.5708 0">'))
    found, error = moved(hangs, [0.0, -1.5, 0.0])
    assert error < 1e-3 and found["elbow"].max_effort > 2.0 * 1.8
