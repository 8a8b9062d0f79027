# SPDX-License-Identifier: Apache-2.0
"""Files with xacro macros, as their makers publish them, are expanded, wherever their packages are, without ROS."""

from __future__ import annotations

import shutil
import sys
from importlib import metadata
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac.robots import urdf
from opengpac.robots.urdf import macros

MAKERS = Path(str(metadata.distribution("rtb-data").locate_file("rtbdata/xacro")))
PUMA = MAKERS / "unimation_puma560_description/urdf/puma560_robot.urdf.xacro"
KR16 = MAKERS / "kuka_description/kuka_kr16"
HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = """<link name="base"/><joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="{effort}" velocity="1"/></joint>
<link name="tip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def test_a_file_of_a_maker_is_expanded_and_its_arm_moves() -> None:
    arm = gpac.robots.load(PUMA, clock="virtual", name="puma")
    expanded = gpac.robots.load("puma560", clock="virtual")
    with arm.system, expanded.system:
        assert [joint.short_name for joint in arm] == [joint.short_name for joint in expanded]
        assert arm.values("position_min") == pytest.approx(expanded.values("position_min"))
        arm.enable()
        gpac.motion.move_absolute(arm, [0.2] * len(arm))
        assert arm.values("sensed") == pytest.approx([0.2] * len(arm), abs=2e-3)


def test_packages_of_macros_are_found_as_those_of_meshes_are(tmp_path: Path) -> None:
    """The maker's file includes another one by `$(find kuka_kr16_support)`, which ROS would resolve."""
    package = tmp_path / "share" / "kuka_kr16_support"
    shutil.copytree(KR16, package)
    shutil.copytree(MAKERS / "kuka_description/kuka_resources", tmp_path / "share" / "kuka_resources")
    converted = urdf.convert(package / "urdf/kr16_2.xacro", [tmp_path / "share"])
    same = urdf.convert(KR16 / "urdf/kr16_2.urdf")
    assert converted.speeds == pytest.approx(same.speeds) and len(converted.speeds) == 6
    with pytest.raises(
        gpac.DeviceFailed, match=r"xacro cannot expand '.*kr16_2.xacro': .*package 'kuka_kr16_support' was not found; specify"
    ):
        urdf.convert(KR16 / "urdf/kr16_2.xacro")


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (ARM.format(effort="${strength}"), r"name 'strength' is not defined"),
        ('<xacro:include filename="gone.xacro"/>' + ARM.format(effort="1"), r"No such file or directory.*gone\.xacro"),
        (ARM.format(effort="$(arg effort)"), r"[Uu]ndefined substitution argument effort"),
        ('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>' + ARM.format(effort="1"), r"recursion depth exceeded"),
        (ARM.format(effort="${len([0] * 10**10)}"), r"MemoryError"),
    ],
)
def test_what_cannot_be_expanded_is_refused_in_words(tmp_path: Path, body: str, said: str) -> None:
    (tmp_path / "arm.xacro").write_text(HEAD + body + "</robot>")
    with pytest.raises(gpac.DeviceFailed, match=rf"xacro cannot expand '.*arm.xacro': .*{said}"):
        gpac.robots.load(tmp_path / "arm.xacro", clock="virtual")


def test_macros_that_compute_too_long_are_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(macros, "SECONDS_MAX", 1)
    (tmp_path / "arm.xacro").write_text(HEAD + ARM.format(effort="${max(range(10**12))}") + "</robot>")
    with pytest.raises(gpac.DeviceFailed, match=r"xacro cannot expand '.*arm.xacro': it takes more than 1 s"):
        gpac.robots.load(tmp_path / "arm.xacro", clock="virtual")


def test_an_error_of_an_included_file_names_it(tmp_path: Path) -> None:
    (tmp_path / "inner.xacro").write_text(HEAD + ARM.format(effort="${nothing}") + "</robot>")
    (tmp_path / "arm.xacro").write_text(HEAD + '<xacro:include filename="inner.xacro"/></robot>')
    with pytest.raises(gpac.DeviceFailed, match=r"cannot expand '.*arm.xacro': .*'nothing' is not defined.*in '.*inner.xacro'"):
        gpac.robots.load(tmp_path / "arm.xacro", clock="virtual")


def test_macros_need_xacro(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xacro", None)
    (tmp_path / "arm.urdf").write_text(HEAD + ARM.format(effort="${10 * 10}") + "</robot>")
    with pytest.raises(
        gpac.DeviceFailed, match=r"contains xacro macros, the first of them on line 2, but xacro is not installed; run pip install xacro"
    ):
        gpac.robots.load(tmp_path / "arm.urdf", clock="virtual")
