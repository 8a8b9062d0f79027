# SPDX-License-Identifier: Apache-2.0
"""No plain move of an arm from the catalogue ends in a following error, for any goal within the ranges and any fraction of its speed.

8 moves are tried, different ones each day; `OPENGPAC_PLAIN_MOVES` sets their number, `OPENGPAC_SEED` the first seed. They cycle
through the arms whose packages are installed, and each starts from home, on a path without contact on which every motor can bear
gravity.
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
"""Maximum number of goals drawn until the arm can reach one."""
PLACES = 12
"""Number of poses of a path that are checked."""
TURN, SLIDE = np.pi, 0.5
"""Maximum movement of a joint without a range, in either direction, rad and m."""
LONGEST_S = 20.0
"""Approximate maximum duration of a move; a slow move goes only part of the way."""
BEARABLE = 0.9
"""Maximum fraction of a motor's effort that gravity may take on the path."""

mujoco: Any = importlib.import_module("mujoco")


class Model:
    """Copy of the simulated model: the gravity that each joint of the arm bears in a pose."""

    def __init__(self, file: Path, joints: list[str]) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(file))
        self.data = mujoco.MjData(self.model)
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        ids = [self.model.joint(name).id for name in joints]
        self.places, self.freedoms = self.model.jnt_qposadr[ids], self.model.jnt_dofadr[ids]

    def gravity(self, pose: np.ndarray) -> np.ndarray:
        """Returns the efforts that hold the arm in a pose, N.m or N."""
        self.data.qpos[self.places] = pose
        mujoco.mj_forward(self.model, self.data)
        return np.abs(self.data.qfrc_bias[self.freedoms] - self.data.qfrc_passive[self.freedoms])


def a_goal(arm: gpac.robots.Arm, share: float, rng: np.random.Generator) -> np.ndarray:
    """Returns a goal within the ranges that the arm can reach: without contact, and with motors that can hold it everywhere on the path."""
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
