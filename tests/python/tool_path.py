# SPDX-License-Identifier: Apache-2.0
"""Poses of an arm's tool along a path, computed in one trial of the block that `arm.forward` runs for a single pose."""

from __future__ import annotations

from typing import Any

import numpy as np

import opengpac as gpac
from opengpac import library


def poses(arm: gpac.robots.Arm, rows: Any) -> np.ndarray:
    """Returns the pose of the tool at each row of joint positions: x, y, z in m, and a quaternion. The last one is compared with
    `arm.forward`."""
    given = np.array([*rows], dtype=float).reshape(-1, len(arm))
    if not len(given):
        return np.zeros((0, 7))
    found = library.block("forward_kinematics").run(n=len(arm), chain=arm.kinematics.chain, q=given)
    assert found.fault is None
    assert [*gpac.Pose.of(found.pose[-1])] == [*arm.forward(given[-1])]
    return found.pose


def places(arm: gpac.robots.Arm, rows: Any) -> np.ndarray:
    """Returns the position of the tool at each row of joint positions, m."""
    return poses(arm, rows)[:, :3]
