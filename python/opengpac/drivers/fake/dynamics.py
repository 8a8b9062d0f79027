# SPDX-License-Identifier: Apache-2.0
"""Arm behind an emulated controller with the dynamics of a model, simulated by MuJoCo, including contact forces."""

from __future__ import annotations

import importlib
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import CallError, DeviceFailed, did_you_mean, refuse
from .arm import CYCLE, JointArm
from .gripper import Gripper

STIFFNESS, DAMPING = (2 * math.pi * 30.0) ** 2, 4 * math.pi * 30.0
"""Controller gains, as acceleration per unit of error: 30 Hz, critically damped."""


class SimulatedArm(JointArm):
    """Six joints of a model, with the control loops of a control box: computed torque, within the effort limits of the model.

    `gripper` holds the model's other actuators, the fingers of the tool.
    """

    def __init__(self, position: Sequence[float], leap_max: float, arm: Path, tool: Path | None, scene: Path | None) -> None:
        super().__init__(position, leap_max)
        from ...robots.assembly import assemble

        try:
            mujoco: Any = importlib.import_module("mujoco")
        except ImportError:
            refuse(DeviceFailed, "the Python package 'mujoco' is not installed", "run pip install 'opengpac[mujoco]'")
        self._mujoco = mujoco
        self._model: Any = mujoco.MjModel.from_xml_string(assemble(arm, tool, scene))
        self._model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        self._data: Any = mujoco.MjData(self._model)
        if self._model.nkey:
            mujoco.mj_resetDataKeyframe(self._model, self._data, 0)
        driven = [int(joint) for joint, _ in self._model.actuator_trnid][: len(self.q)]
        more = range(len(self.q), self._model.nu)
        if len(driven) != len(self.q):
            refuse(CallError, f"model '{arm}' has {len(driven)} driven joints", "use the model of an arm with six")
        self._places = self._model.jnt_qposadr[driven]
        self._speeds = self._model.jnt_dofadr[driven]
        self._efforts = np.abs(self._model.actuator_ctrlrange[: len(self.q)]).max(axis=1)
        self._site: int = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SITE, "tool")
        if min(self._site, mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SENSOR, "tool_force")) < 0:
            refuse(
                CallError,
                f"model '{arm}' lacks site 'tool' or sensor 'tool_force'",
                "add both; together they form the force sensor of the tool",
            )
        self._sensed = self.sensor("tool_force")
        self._steps = max(1, round(CYCLE / self._model.opt.timestep))
        self._before = np.array(self.q)
        self._data.qpos[self._places] = self.q
        mujoco.mj_forward(self._model, self._data)
        self._data.qfrc_applied[self._speeds] = self._data.qfrc_bias[self._speeds]
        mujoco.mj_forward(self._model, self._data)
        self.gripper = Gripper(mujoco, self._model, more) if more else None
        if self.gripper is not None:
            self.gripper.start(self._data)

    def advance(self) -> None:
        """Advances the simulation by one cycle, with the control loops tracking the interpolated goal."""
        goal, data = np.array(self.goal), self._data
        rate = (goal - self._before) / CYCLE
        pull, effort = np.zeros(self._model.nv), np.zeros(self._model.nv)
        for step in range(1, self._steps + 1):
            wanted = self._before + rate * CYCLE * step / self._steps
            pull[self._speeds] = STIFFNESS * (wanted - data.qpos[self._places]) + DAMPING * (rate - data.qvel[self._speeds])
            self._mujoco.mj_mulM(self._model, data, effort, pull)
            effort += data.qfrc_bias - data.qfrc_passive
            data.qfrc_applied[self._speeds] = np.clip(effort[self._speeds], -self._efforts, self._efforts)
            if self.gripper is not None:
                self.gripper.push(data)
            self._mujoco.mj_step(self._model, data)
        self._before = goal
        if self.gripper is not None:
            self.gripper.tell(data)
        self.q, self.velocity = data.qpos[self._places].tolist(), data.qvel[self._speeds].tolist()

    def rest(self) -> None:
        """Holds the current position."""
        super().rest()
        self._before = np.array(self.q)

    def sensor(self, name: str) -> slice:
        """Returns the slice of the sensor of this name in the sensor data. Raises `CallError` if it does not exist."""
        number: int = self._mujoco.mj_name2id(self._model, self._mujoco.mjtObj.mjOBJ_SENSOR, name)
        if number < 0:
            known = [self._mujoco.mj_id2name(self._model, self._mujoco.mjtObj.mjOBJ_SENSOR, at) for at in range(self._model.nsensor)]
            refuse(CallError, f"the model has no sensor '{name}'", did_you_mean(name, [name for name in known if name]))
        first = int(self._model.sensor_adr[number])
        return slice(first, first + int(self._model.sensor_dim[number]))

    def reading(self, at: slice) -> list[float]:
        """Returns the readings in that slice, in MuJoCo's units."""
        return self._data.sensordata[at].tolist()

    def close(self) -> None:
        """Closes the gripper's server."""
        if self.gripper is not None:
            self.gripper.close()

    def touch(self) -> list[float]:
        """Returns the contact force on the tool, N, in the base frame, without the tool's weight."""
        body = self._model.site_bodyid[self._site]
        turned = self._data.site_xmat[self._site].reshape(3, 3) @ self._data.sensordata[self._sensed]
        # The force of the flange on the tool balances the tool's weight and the contact forces.
        return (-turned - self._model.body_subtreemass[body] * self._model.opt.gravity).tolist()


def model_of(name: str | os.PathLike[str]) -> Path:
    """Returns the model file of an arm: the package's file if `name` is the name of one of its arms, otherwise the path itself."""
    known = Path(__file__).parents[2] / "robots" / f"{name}.xml"
    return known if known.is_file() else Path(name).expanduser().absolute()
