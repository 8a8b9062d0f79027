# SPDX-License-Identifier: Apache-2.0
"""Arms that are known by their joints alone: no file says their geometry, so they are driven, not simulated."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from ..devices.physical import PhysicalDevice
from ..drivers import Driver
from ..errors import CallError, DefinitionError, refuse
from ..system.processors import Processor
from ..system.sources import Source
from .kinematics import Kinematics


@dataclass(frozen=True)
class Bare:
    """An arm of servos: its joints, in the order of the servos' ids from 1 on, as it is built from its kit."""

    name: str
    joints: tuple[str, ...]
    model: str

    def wired(self, driver: Driver | None) -> Driver | None:
        """The driver with its servos, where the program does not say them."""
        if driver is None or driver.kind != "feetech" or "servos" in driver.options or "calibration" in driver.options:
            return driver
        servos = {joint: {"id": id, "model": self.model} for id, joint in enumerate(self.joints, 1)}
        return Driver(driver.kind, {**driver.options, "servos": servos})

    @property
    def own_joints(self) -> Collection[str]:
        """Those that the driver is to have."""
        return self.joints

    @property
    def speeds(self) -> Mapping[str, float]:
        """The driver's own."""
        return {}

    @property
    def identity(self) -> str:
        """Returns its identifier among models."""
        return f"name:{self.name}"

    @property
    def notes(self) -> tuple[str, ...]:
        """None: there is no file."""
        return ()

    @property
    def held_back(self) -> Collection[str]:
        """None that is known."""
        return ()

    @property
    def groups(self) -> Mapping[str, Any]:
        """None, as it has no states and no interfaces."""
        return {}

    states = interfaces = groups
    simulated = None
    """It has no model."""

    def open(self, rtp: Processor, name: str, on: Source, apart: bool | str, contacts: int) -> PhysicalDevice:
        """Without a driver there is nothing to open."""
        refuse(
            CallError, f"'{self.name}' is not simulated here", f'give its driver: load("{self.name}", driver=gpac.drivers.feetech(port))'
        )

    def kinematics(self, joints: list[str]) -> Kinematics:
        """It has none."""
        refuse(DefinitionError, f"the geometry of '{self.name}' is not known here", "load its URDF or MJCF file with the same driver")


BARE: Mapping[str, Bare] = {
    arm.name: arm
    for arm in [Bare("so101", ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"), "sts3215")]
}
"""The arms of that kind by their names."""
