# SPDX-License-Identifier: Apache-2.0
"""Joints are named as in their file: with dots, slashes, spaces, umlauts; two with the same last word are distinguished."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac

NAMES = ["left.elbow", "right.elbow", "arm/wrist 1", "Schlüssel.größe", "arm/größe", "j"]
LINK = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
JOINT = (
    '<joint name="{name}" type="revolute"><parent link="{below}"/><child link="{above}"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" effort="20" velocity="2"/></joint>'
)


@pytest.fixture
def arm(tmp_path: Path) -> Iterator[gpac.robots.Arm]:
    """Yields a chain of joints with odd names, with an SRDF state for each."""
    links = ["base", *(f"link{index}" for index in range(len(NAMES)))]
    joints = [JOINT.format(name=name, below=links[index], above=links[index + 1]) for index, name in enumerate(NAMES)]
    (tmp_path / "odd.urdf").write_text(f'<robot name="odd">{"".join(map(LINK.format, links))}{"".join(joints)}</robot>')
    values = "".join(f'<joint name="{name}" value="{0.1 * index}"/>' for index, name in enumerate(NAMES))
    group = "".join(f'<joint name="{name}"/>' for name in NAMES[:2])
    (tmp_path / "odd.srdf").write_text(
        f'<robot name="odd"><group name="both">{group}</group><group_state name="up" group="both">{values}</group_state></robot>'
    )
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        rtp.timer("slow", period="20 ms", priority=60)
        yield gpac.robots.load(tmp_path / "odd.urdf", rtp, on=rtp.timer("fast", period="1 ms", priority=80)).enable()


def test_a_joint_is_named_by_its_name_in_the_file(arm: gpac.robots.Arm) -> None:
    assert [arm[name].name for name in NAMES] == [f"odd.{name}" for name in NAMES] == [arm[f"odd.{name}"].name for name in NAMES]
    for index, name in enumerate(NAMES):
        assert gpac.motion.move_absolute(arm[name], 0.1 * index).condition == "arrived"
        assert abs(arm[name].sensed.value - 0.1 * index) < 1e-3


def test_two_that_shorten_to_one_are_told_apart(arm: gpac.robots.Arm) -> None:
    assert arm.short_names == ["left.elbow", "right.elbow", "arm/wrist 1", "größe", "arm/größe", "j"] == arm._ipython_key_completions_()
    assert arm["größe"] is arm["Schlüssel.größe"] is not arm["arm/größe"]
    for both in (lambda: arm["elbow"], lambda: arm.elbow):
        with pytest.raises(gpac.UnknownName, match=r"has 2 devices named 'elbow'; use a longer name: 'left\.elbow', 'right\.elbow'"):
            both()
    with pytest.raises(gpac.UnknownName, match=r"did you mean 'left\.elbow'\?"):
        arm["left.ellbow"]
    assert "left.elbow, right.elbow" in repr(arm)


def test_a_group_an_own_joint_and_a_longer_name_of_one_ending_are_told_apart() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms")
        names = ["elbow", "arm.elbow", "other.arm.elbow"]
        drive = cell.processors["rtp0"].physical_device("d", gpac.drivers.loopback(*"xyz"), exchange=fast)
        joints = [gpac.robots.Joint(name, drive=drive[part], on=fast) for name, part in zip(names, "xyz", strict=True)]
        group = gpac.Group("all", *joints)
        assert group.short_names == names
        assert [group[name] for name in names] == joints, "a whole name goes before an ending"


def test_values_by_name_reach_the_joint_that_they_name(arm: gpac.robots.Arm) -> None:
    arm.kp = {"left.elbow": 60.0, "arm/größe": 70.0}
    assert (arm["left.elbow"].kp, arm["arm/größe"].kp) == (60.0, 70.0) and arm["right.elbow"].kp not in (60.0, 70.0)
    before = arm.values("sensed")
    goal: dict[str, float | str] = {"right.elbow": 0.3, "arm/wrist 1": -0.2}
    assert gpac.motion.move_absolute(arm, goal).condition == "arrived"
    assert arm.values("sensed") == pytest.approx([before[0], 0.3, -0.2, *before[3:]], abs=1e-3)
    with pytest.raises(gpac.UnknownName, match=r"names 'elbow', which is not a member of group 'odd'; use a longer name: 'left\.elbow'"):
        gpac.motion.move_absolute(arm, {"elbow": 0.3})


def test_states_groups_and_points_have_the_names_of_the_file(arm: gpac.robots.Arm, tmp_path: Path) -> None:
    assert arm.states["up"] == pytest.approx({name: 0.1 * index for index, name in enumerate(NAMES)})
    assert arm.part("both").states["up"] == pytest.approx({"left.elbow": 0.0, "right.elbow": 0.1})
    assert gpac.motion.move_absolute(arm, {**arm.states["up"]}).condition == "arrived"
    points = gpac.Points(tmp_path / "points.toml", arm)
    taught = points.teach("here")
    assert list(taught) == arm.short_names
    again: Any = gpac.Points(tmp_path / "points.toml", arm)["here"]
    assert gpac.motion.move_absolute(arm, again).condition == "arrived"
    assert arm.forward(again) == arm.forward(list(again.values())), "a point is taken by the names of its joints"
    with pytest.raises(gpac.CallError, match=r"the joint positions lack joint 'arm/wrist 1'; they have left\.elbow, right\.elbow"):
        arm.forward(dict(list(again.items())[:2]))
