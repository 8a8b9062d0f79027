# SPDX-License-Identifier: Apache-2.0
"""Gripper mounted on an emulated arm. Its own controller drives the fingers, and communicates over Modbus."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..driver import Driver
from ..modbus import modbus as modbus_driver
from .modbus import Modbus

STIFFNESS, DAMPING = 150.0, 6.0
"""Gains of the gripper's control loops: N per metre of position error, and N per m/s."""
PITCH = 10
"""Register spacing between fingers."""
_READ = {"position": ("int16", 1e-5, "m"), "velocity": ("int16", 1e-4, "m/s"), "force": ("uint16", 1e-3, "N")}
_WRITTEN = {"goal": ("int16", 1e-5, "m"), "force_max": ("uint16", 1e-3, "N")}


class Gripper:
    """The fingers of a model, each a spring of limited force about its goal; `address` is the address of the gripper's Modbus server.

    The registers of finger k start at `10 k`: the input registers are position (10 µm), velocity (0.1 mm/s) and contact force of its
    pad (mN), the holding registers goal (10 µm) and maximum force (mN). The maximum force is zero until it is set.
    """

    def __init__(self, mujoco: Any, model: Any, actuators: range) -> None:
        self.fingers: list[str] = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator) for actuator in actuators]
        joints = [int(model.actuator_trnid[actuator][0]) for actuator in actuators]
        sensors = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name) for name in self.fingers]
        self._places, self._speeds = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._pads: list[int | None] = [None if sensor < 0 else int(model.sensor_adr[sensor]) for sensor in sensors]
        self._effort_max = np.abs(model.actuator_ctrlrange[actuators]).max(axis=1)
        self._tables = Modbus((1,), serial=False)
        for finger in range(len(self.fingers)):
            for at in range(len(_WRITTEN)):
                self._tables.put("holding", PITCH * finger + at, 0)

    @property
    def address(self) -> str:
        """Address of the gripper's Modbus server."""
        return self._tables.address

    def driver(self, **options: Any) -> Driver:
        """Returns the driver for `gpac.robots.gripper`, with a channel for each register, such as `left_finger.goal`."""
        channels: dict[str, dict[str, Any]] = {}
        for finger, name in enumerate(self.fingers):
            for table, words in (("input", _READ), ("holding", _WRITTEN)):
                for at, (word, (kind, scale, unit)) in enumerate(words.items(), PITCH * finger):
                    channels[f"{name}.{word}"] = {table: at, "type": kind, "scale": scale, "unit": unit, "write": table == "holding"}
        return modbus_driver(self.address, channels=channels, **options)

    def start(self, data: Any) -> None:
        """Sets the goals to the positions of the fingers, and starts the server."""
        self.tell(data)
        for finger, place in enumerate(self._places):
            self._put("holding", finger, "goal", _WRITTEN, data.qpos[place])
        self._tables.start()

    def close(self) -> None:
        """Closes the server."""
        self._tables.close()

    def push(self, data: Any) -> None:
        """Applies the forces of the gripper's motors for one simulation step."""
        for finger, (place, speed) in enumerate(zip(self._places, self._speeds, strict=True)):
            goal, most = (self._get(finger, word) for word in _WRITTEN)
            spring = np.clip(STIFFNESS * (goal - data.qpos[place]), -most, most)
            effort = spring - DAMPING * data.qvel[speed] + data.qfrc_bias[speed] - data.qfrc_passive[speed]
            data.qfrc_applied[speed] = np.clip(effort, -self._effort_max[finger], self._effort_max[finger])

    def tell(self, data: Any) -> None:
        """Updates the gripper's readings: the positions of its fingers, and their contact forces."""
        for finger, (place, speed, pad) in enumerate(zip(self._places, self._speeds, self._pads, strict=True)):
            felt = 0.0 if pad is None else data.sensordata[pad]
            for word, value in (("position", data.qpos[place]), ("velocity", data.qvel[speed]), ("force", felt)):
                self._put("input", finger, word, _READ, value)

    def _put(self, table: str, finger: int, word: str, of: dict[str, tuple[str, float, str]], value: float) -> None:
        kind, scale, _ = of[word]
        least, most = (-0x8000, 0x7FFF) if kind == "int16" else (0, 0xFFFF)
        self._tables.put(table, PITCH * finger + [*of].index(word), min(max(round(value / scale), least), most), kind)

    def _get(self, finger: int, word: str) -> float:
        kind, scale, _ = _WRITTEN[word]
        return scale * self._tables.get("holding", PITCH * finger + [*_WRITTEN].index(word), kind)
