# SPDX-License-Identifier: Apache-2.0
"""Frames from three points and tools from four touches, compared with SciPy's rotations and a known tool."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import opengpac as gpac
from opengpac.robots import tool_by_touching

ANGLES = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
PLACES = st.tuples(*[st.floats(-5, 5)] * 3)
TOOL = gpac.Frame((0.02, -0.03, 0.15), rpy=(0, "20 deg", 0))


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields an enabled UR5e at home."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system, made.enabled():
        yield made


@given(PLACES, ANGLES, st.floats(0.01, 2), st.floats(-2, 2), st.floats(0.01, 2))
def test_a_frame_is_found_from_three_of_its_points(
    place: tuple[float, ...], angles: tuple[float, ...], on_x: float, along: float, beside: float
) -> None:
    frame = gpac.Frame(place, rpy=angles)
    found = gpac.Frame.by_points(frame, frame @ (on_x, 0, 0), gpac.Pose(frame @ (along, beside, 0), rpy=(1, 0, 0)))
    assert found.distance(frame) == 0
    assert found.angle(frame) < 1e-6
    turned = Rotation.from_euler("xyz", angles)
    assert (Rotation.from_quat(found.quaternion, scalar_first=True) * turned.inv()).magnitude() < 1e-6


def test_places_that_tell_no_frame_are_refused() -> None:
    assert gpac.Frame.by_points((0, 0, 0), ("100 mm", 0, 0), (0, "1 cm", 0)) == gpac.Frame()
    for given_places, words in [
        (((0, 0, 0), (0, 0, 5e-4), (0, 1, 0)), "the point on the x axis is too close to the origin: 0.0005 m"),
        (((0, 0, 0), (1, 0, 0), (2, 0, 0)), "the point in the xy plane is too close to the x axis: 0 m"),
        (((0, 0, 0), (1, 0, 0), (-1, 5e-4, 0)), "the point in the xy plane is too close to the x axis: 0.0005 m"),
        (((0, 0), (1, 0, 0), (0, 1, 0)), "must have 3 numbers, not 2"),
        (((0, 0, math.nan), (1, 0, 0), (0, 1, 0)), "must be a finite number, not nan"),
    ]:
        with pytest.raises(gpac.ValueRefused, match=words):
            gpac.Frame.by_points(*given_places)


def touches(arm: gpac.robots.Arm, angles: float, count: int = 4, noise: float = 0.0) -> list[np.ndarray]:
    """Returns joint positions at which the tip of `TOOL` touches one point, with the tool turned by up to `angles` about several axes."""
    chance = np.random.default_rng(5)
    before, arm.tool = arm.tool, TOOL
    tip, found = arm.pose(), []
    for k in range(count):
        turn = angles * np.array([math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count), 0.7 * (-1) ** k])
        shift = tuple(chance.normal(0, noise, 3)) if noise else (0.0, 0.0, 0.0)
        found.append(arm.inverse(gpac.Pose(shift) @ tip @ gpac.Pose(rpy=tuple(turn))))
    arm.tool = before
    return found


def test_a_tool_is_found_from_four_touches_of_its_tip(arm: gpac.robots.Arm) -> None:
    # The present tool does not matter.
    for now in (gpac.Frame(), gpac.Frame((0.1, 0, 0), rpy=(1, 0, 0))):
        arm.tool = now
        found = tool_by_touching(arm, touches(arm, 0.4), orientation=(0, "20 deg", 0))
        assert found.frame.distance(TOOL) < 1e-5
        assert found.frame.angle(TOOL) < 1e-6
        assert found.residual < 1e-6
        assert found.residuals.shape == (4,)
        arm.tool = found.frame
        assert np.linalg.norm(arm.forward(touches(arm, 0.4)[0]).position - found.tip) < 1e-5


def test_errors_of_the_touches_are_told_and_bounded(arm: gpac.robots.Arm) -> None:
    found = tool_by_touching(arm, touches(arm, 0.4, 8, noise=2e-4))
    assert 5e-5 < found.residual < 5e-4
    assert found.frame.distance(TOOL) < 3 * 2e-4 / found.spread
    wrong = touches(arm, 0.4, 6)
    wrong[2] = wrong[2] + np.array([0.05, 0, 0, 0, 0, 0])
    with pytest.raises(
        gpac.ValueRefused, match=r"the tip at position 2 \(counted from 0\) is .* m from the common point, more than 0.002 m"
    ):
        tool_by_touching(arm, wrong)


def test_places_that_tell_no_tool_are_refused(arm: gpac.robots.Arm) -> None:
    with pytest.raises(gpac.CallError, match="3 positions are too few; pass 4 or more"):
        tool_by_touching(arm, touches(arm, 0.4)[:3])
    with pytest.raises(gpac.ValueRefused, match="the orientations of the tool at the 4 positions are too similar"):
        tool_by_touching(arm, touches(arm, 0.02))
    # All turns are about one axis: the displacement along that axis cannot be observed.
    about_one = [[*arm.values("sensed")[:5], angle] for angle in (0.0, 1.0, 2.0, 3.0)]
    with pytest.raises(gpac.ValueRefused, match="about two axes"):
        tool_by_touching(arm, about_one)


def test_taught_points_give_a_tool(arm: gpac.robots.Arm, tmp_path: Path) -> None:
    points = gpac.Points(tmp_path / "points.toml", arm)
    for k, q in enumerate(touches(arm, 0.4)):
        gpac.motion.move_absolute(arm, q)
        arm.system.advance("0.3 s")
        points.teach(f"tip {k}")
    found = tool_by_touching(arm, [points[f"tip {k}"] for k in range(4)])
    assert found.frame.distance(TOOL) < 1e-3


def test_a_point_that_lacks_a_joint_is_refused_with_its_place_and_the_joint(arm: gpac.robots.Arm) -> None:
    places: list[Any] = [dict(zip(arm.short_names, q, strict=True)) for q in touches(arm, 0.4)]
    assert tool_by_touching(arm, places).frame.distance(TOOL) < 1e-5
    del places[2]["wrist_1"]
    with pytest.raises(
        gpac.CallError, match=r"position 2 \(counted from 0\): the joint positions lack joint 'wrist_1'; they have shoulder_pan"
    ):
        tool_by_touching(arm, places)
    with pytest.raises(gpac.CallError, match="pass a number for each joint"):
        arm.kinematics.forward(places[2])
