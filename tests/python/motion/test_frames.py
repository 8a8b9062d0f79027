# SPDX-License-Identifier: Apache-2.0
"""Poses: composition, inverse, units, and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opengpac as gpac

ANGLES = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
PLACES = st.tuples(*[st.floats(-10, 10)] * 3)


@given(PLACES, ANGLES, PLACES, ANGLES)
def test_composition_is_that_of_the_matrices(
    p: tuple[float, ...], a: tuple[float, ...], q: tuple[float, ...], b: tuple[float, ...]
) -> None:
    first, second = gpac.Pose(p, rpy=a), gpac.Pose(q, rpy=b)
    assert np.allclose((first @ second).matrix, first.matrix @ second.matrix, atol=1e-12)
    assert np.allclose(first @ q, (first.matrix @ [*q, 1])[:3], atol=1e-12)
    back = first @ first.inverse()
    assert back.distance(gpac.Pose()) < 1e-12
    assert back.angle(gpac.Pose()) < 1e-12


@given(PLACES, ANGLES)
def test_seven_numbers_and_rpy_come_back(p: tuple[float, ...], a: tuple[float, ...]) -> None:
    pose = gpac.Pose(p, rpy=a)
    assert gpac.Pose.of(list(pose)).angle(pose) < 1e-12
    assert gpac.Pose.of(np.array(list(pose))).distance(pose) == 0
    assert gpac.Pose(p, rpy=pose.rpy).angle(pose) < 1e-7


def test_rpy_turns_about_the_fixed_axes_in_that_order() -> None:
    turned = gpac.Pose(rpy=("90 deg", 0, "90 deg"))
    assert np.allclose(turned @ (0, 1, 0), (0, 0, 1))
    assert np.allclose(turned @ (1, 0, 0), (0, 1, 0))
    assert math.isclose(turned.angle(gpac.Pose()), math.radians(120))
    upright = gpac.Pose(rpy=(0.3, "90 deg", 0))
    assert gpac.Pose(rpy=upright.rpy).angle(upright) < 1e-9


def test_units_are_read_and_shown() -> None:
    pose = gpac.Pose(("400 mm", 0, "30 cm"), rpy=("180 deg", 0, 0))
    assert np.allclose(pose.position, (0.4, 0, 0.3))
    assert repr(pose) == "Pose(0.4, 0, 0.3 m; rpy 180, 0, 0 deg)"
    assert list(gpac.Pose()) == [0, 0, 0, 1, 0, 0, 0]
    assert gpac.Frame is gpac.Pose
    assert len({gpac.Pose(), gpac.Pose((0, 0, 0))}) == 1


@pytest.mark.parametrize(
    "make",
    [
        lambda: gpac.Pose((1, 2)),
        lambda: gpac.Pose("123"),
        lambda: gpac.Pose((0, 0, math.nan)),
        lambda: gpac.Pose((0, 0, True)),
        lambda: gpac.Pose(rpy=(0, 0, "90 mm")),
        lambda: gpac.Pose(quaternion=(0, 0, 0, 0)),
        lambda: gpac.Pose(quaternion=(2, 0, 0, 0)),
        lambda: gpac.Pose(rpy=(0, 0, 0), quaternion=(1, 0, 0, 0)),
        lambda: gpac.Pose.of([0, 0, 0]),
    ],
)
def test_what_is_no_pose_is_refused_with_the_line_of_the_program(make: object) -> None:
    with pytest.raises((gpac.ValueRefused, gpac.UnitMismatch)) as refused:
        make()  # type: ignore[operator]
    assert refused.value.file == __file__
