# SPDX-License-Identifier: Apache-2.0
"""No plain move of an arm known by name ends in a following error: any goal within the ranges, at any share of its speed.

8 moves are tried, others each day, or as many as `OPENGPAC_PLAIN_MOVES` says; `OPENGPAC_SEED` is the first seed. They go through the arms
whose packages are installed, and each is made from home, on a way on which nothing touches and at which every motor bears gravity.
"""

from __future__ import annotations

import datetime
import importlib
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.robots.catalogue import KNOWN
from opengpac.robots.touching import touching

MOVES = int(os.environ.get("OPENGPAC_PLAIN_MOVES", "8"))
FIRST = int(os.environ.get("OPENGPAC_SEED", datetime.date.today().toordinal() * 1000))
ARMS = [name for name, arm in KNOWN.items() if arm.is_installed()]
GOALS = 50
"""Goals that are drawn until one is found to which the arm can go."""
PLACES = 12
"""Poses of a way that are looked at."""
TURN, SLIDE = np.pi, 0.5
"""How far a joint without a range moves either way, rad and m."""
LONGEST_S = 20.0
"""A slow move goes only part of the way, so that it takes no longer than about this."""
BEARABLE = 0.9
"""The share of a motor's effort that gravity may take on the way."""

mujoco: Any = importlib.import_module("mujoco")


class Model:
    """What is simulated, apart from its simulation: the gravity that each joint of the arm bears in a pose."""

    def __init__(self, file: Path, joints: list[str]) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(file))
        self.data = mujoco.MjData(self.model)
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        ids = [self.model.joint(name).id for name in joints]
        self.places, self.freedoms = self.model.jnt_qposadr[ids], self.model.jnt_dofadr[ids]

    def gravity(self, pose: np.ndarray) -> np.ndarray:
        """The efforts that hold the arm in a pose, N.m or N."""
        self.data.qpos[self.places] = pose
        mujoco.mj_forward(self.model, self.data)
        return np.abs(self.data.qfrc_bias[self.freedoms] - self.data.qfrc_passive[self.freedoms])


def a_goal(arm: gpac.robots.Arm, share: float, rng: np.random.Generator) -> np.ndarray:
    """A goal within the ranges to which the arm can go: it meets nothing, and its motors can hold it everywhere on the way."""
    names = [joint.name.removeprefix(f"{arm.name}.") for joint in arm]
    home, most = np.array(arm.values("sensed")), np.array(arm.values("max_effort"))
    whole = np.array([SLIDE if joint.sensed.unit == "m" else TURN for joint in arm])
    low = np.maximum(arm.values("position_min"), home - whole)
    high = np.minimum(arm.values("position_max"), home + whole)
    assert arm._scene is not None
    model = Model(arm._scene, names)
    for _ in range(GOALS):
        goal = rng.uniform(low, high)
        needed_s = float(np.max(np.abs(goal - home) / (share * np.array(arm.values("max_speed")))))
        goal = home + (goal - home) * min(1.0, LONGEST_S / needed_s)
        way = [home + part * (goal - home) for part in np.linspace(0.0, 1.0, PLACES)]
        meets = any(touching(arm._scene, dict(zip(names, pose.tolist(), strict=True))) for pose in way)
        if not meets and all(np.all(model.gravity(pose) <= BEARABLE * most) for pose in way):
            return goal
    pytest.fail(f"{arm.name}: none of {GOALS} goals can be reached")


@pytest.mark.parametrize("number", range(MOVES))
def test_no_plain_move_ends_in_a_following_error(number: int) -> None:
    seed = FIRST + number
    rng = np.random.default_rng(seed)
    name, share = ARMS[seed % len(ARMS)], float(10.0 ** rng.uniform(-2.0, 0.0))
    arm = gpac.robots.load(name, clock="virtual").enable()
    with arm.system as cell:
        goal = a_goal(arm, share, rng)
        told = f"{name}, seed {seed}, {100 * share:.3g} % to {goal.round(3).tolist()}"
        try:
            gpac.motion.move_absolute(arm, goal, speed=f"{100 * share:.6g} %", time_limit="60 s")
        except gpac.Terminated as error:
            pytest.fail(f"{told}: {error}")
        cell.advance("500 ms")
        away = np.abs(np.array(arm.values("sensed")) - goal)
        assert np.all(away < [1e-4 if joint.sensed.unit == "m" else 1e-3 for joint in arm]), told
