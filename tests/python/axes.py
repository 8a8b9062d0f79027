# SPDX-License-Identifier: Apache-2.0
"""A machine for tests of motion: two axes on a loopback device under the virtual clock, and a watch on the smoothness of their commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import opengpac as gpac
from opengpac import activate
from opengpac.robots import Joint
from opengpac.system.processors import Processor

SPEED, ACCELERATION, JERK = 1.0, 4.0, 80.0
RANGE = (-2.0, 2.0)


def machine(cell: gpac.System, on: Processor | None = None, **changes: Any) -> gpac.Group[Joint]:
    """Returns two axes, `x` and `y`, enabled, on a processor of the system or a new one; `changes` apply to both."""
    rtp = on or cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    rtp.timer("slow", period="20 ms", priority=60)
    plant = rtp.physical_device("plant", gpac.drivers.loopback("x", "y"), exchange=fast)
    about: dict[str, Any] = {
        "position_min": RANGE[0], "position_max": RANGE[1], "max_speed": SPEED, "max_acceleration": ACCELERATION, "max_jerk": JERK,
        "kp": 50.0, "kd": 0.0, "max_following_error": 0.5,
    }  # fmt: skip
    joints = [Joint(f"axes.{name}", drive=plant[name], on=fast, **about | changes) for name in ("x", "y")]
    return gpac.Group("axes", *joints).enable()


nap = gpac.Verb("nap", blocks={"b": gpac.library.flag}, command_lists={"start": [activate("b")]}, instantiation_parameters={"y": "b.y"})


def late(rtp: Processor, ms: int, priority: int = 90) -> Callable[[], None]:
    """Returns a function that keeps everything of a lower priority from the processor for `ms`, once."""
    hog = rtp.trigger("hog", priority=priority, virtual_cost=f"{ms} ms")
    nap.on(hog).asynch(rtp.system.svv("napped", bool))
    return hog.request


class Watch:
    """Advances time, and checks how smoothly the joints have been commanded at 1 ms since its creation: `watch.run(500)`,
    `watch.smooth()`."""

    def __init__(self, axes: gpac.Group[Joint]) -> None:
        self.axes = axes
        self._begun = axes.system.now

    def run(self, steps: int = 20_000, until: Callable[[], Any] = lambda: False) -> Watch:
        """Advances up to `steps` ms, until a condition holds, which is checked every 10 ms."""
        for _ in range(0, steps, 10):
            self.axes.system.advance("10 ms")
            if until():
                break
        return self

    def wait(self, instance: gpac.VerbInstance[Any]) -> Any:
        """Advances until a verb instance has ended, and 100 ms more; returns its report."""
        self.run(until=lambda: instance.done)
        self.run(100)
        return instance.wait()

    @property
    def path(self) -> np.ndarray:
        """Commanded positions of the joints, one row per ms, one column per joint."""
        histories = [joint.reference.history[:] for joint in self.axes]
        assert all((np.diff(history["number"]) == 1).all() for history in histories), "every invocation of the servo"
        return np.array([history["value"][history["time"] > self._begun] for history in histories]).T

    def smooth(self, acceleration: float = ACCELERATION) -> np.ndarray:
        """Returns the speeds at 1 ms. Checks that neither position nor speed ever jumped."""
        speed = np.diff(self.path, axis=0) / 1e-3
        assert np.abs(speed).max() <= SPEED * (1 + 1e-6), f"{np.abs(speed).max()} rad/s"
        change = np.abs(np.diff(speed, axis=0)) / 1e-3
        assert change.max() <= acceleration * (1 + 1e-6), f"{change.max()} rad/s² at {change.max(axis=1).argmax()} ms"
        return speed
