# SPDX-License-Identifier: Apache-2.0
"""Efforts of the motors of a simulated arm, and the rate of their reversals."""

from __future__ import annotations

from typing import Any

import numpy as np

import opengpac as gpac
from opengpac import library as lib
from opengpac.definition.commands import activate

HISTORY = 40_000
"""Number of kept values of a motor's effort, 1 ms each: longer than any move."""
PERIOD_S = 1e-3
"""Period of the kept values, s."""
WINDOW = 500
"""Number of values over which reversals are counted, half a second."""
SWING = 0.05
"""Minimum swing of an effort that counts, as the fraction of a joint's maximum acceleration that it alone causes."""

_watch = gpac.Verb(
    "watch_motor",
    doc="Keeps the effort of a motor.",
    blocks={"read": lib.block("read_channel")},
    instantiation_parameters={"motor": "read.channel", "effort": "read.y"},
    command_lists={"start": [activate("read", every="1 ms")]},
)


class Efforts:
    """Efforts of an arm's motors from the creation of this object."""

    def __init__(self, arm: Any) -> None:
        self.system = arm.system
        self.seen, self.kept, self.swings = self.system.now, [], []
        device = self.system.physical_devices[arm.name]
        for joint in arm:
            part = device[joint.name.removeprefix(f"{arm.name}.")]
            effort = self.system.svv(f"effort of {joint.name}", unit="N" if joint.sensed.unit == "m" else "N.m", history=HISTORY)
            _watch.on(device.source).asynch(part["motor_effort"], effort)
            # A servo without coupling is critically damped: kd^2 = 4 kp J.
            gains = part.about["decoupled"]
            inertia = gains["kd"] ** 2 / (4.0 * gains["kp"])
            self.kept.append(effort)
            self.swings.append(SWING * inertia * joint.max_acceleration)

    def reversals(self) -> list[float]:
        """Returns for each joint the highest rate at which its effort alternated since the last call, Hz."""
        since, self.seen = self.seen, self.system.now
        since_last = round((self.seen - since) / PERIOD_S) + 1
        rates = []
        for effort, swing in zip(self.kept, self.swings, strict=True):
            kept = effort.history[-since_last:]
            rates.append(fastest(kept["value"][kept["time"] >= since], swing))
        return rates


def fastest(values: np.ndarray, swing: float) -> float:
    """Returns the highest rate of cycles of at least `swing` in a window, Hz; 0 if the signal goes back and forth less than twice."""
    turns = turning_points(values, swing)
    if len(turns) < 4:
        return 0.0
    counts = np.searchsorted(turns, turns + WINDOW, side="left") - np.arange(len(turns))
    return float(counts.max() / 2.0 / (WINDOW * PERIOD_S))


def turning_points(values: np.ndarray, swing: float) -> np.ndarray:
    """Returns the indices at which a signal has turned by at least `swing`."""
    turns: list[int] = []
    low = high = values[0] if len(values) else 0.0
    rising: bool | None = None
    for place, value in enumerate(values.tolist()):
        low, high = min(low, value), max(high, value)
        if rising is not False and high - value >= swing:
            turns += [place] if rising else []
            rising, low, high = False, value, value
        elif rising is not True and value - low >= swing:
            turns += [place] if rising is False else []
            rising, low, high = True, value, value
    return np.array(turns)
