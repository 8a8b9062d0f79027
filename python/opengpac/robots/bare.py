# SPDX-License-Identifier: Apache-2.0
"""Arms of which only the joints are known: no file defines their geometry, so they can be driven, but not simulated."""

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
    """An arm of servos: its joints, in the order of the servo IDs, starting at 1, as assembled from its kit."""

    name: str
    joints: tuple[str, ...]
    model: str

    def wired(self, driver: Driver | None) -> Driver | None:
        """Returns the driver with the arm's servos, unless the program sets the servos."""
        if driver is None or driver.kind != "feetech" or "servos" in driver.options or "calibration" in driver.options:
            return driver
        servos = {joint: {"id": id, "model": self.model} for id, joint in enumerate(self.joints, 1)}
        return Driver(driver.kind, {**driver.options, "servos": servos})

    @property
    def own_joints(self) -> Collection[str]:
        """Joints that the driver must have."""
        return self.joints

    @property
    def speeds(self) -> Mapping[str, float]:
        """Maximum speeds of the joints: empty, because the driver has its own limits."""
        return {}

    @property
    def identity(self) -> str:
        """Identifier of the model."""
        return f"name:{self.name}"

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on corrections to the file: empty, because there is no file."""
        return ()

    @property
    def held_back(self) -> Collection[str]:
        """Joints with dry friction or mimic joints: none are known."""
        return ()

    @property
    def groups(self) -> Mapping[str, Any]:
        """Groups, states and interfaces: empty, since no file declares them."""
        return {}

    states = interfaces = groups
    simulated = None
    """Path of the simulated model; always None."""

    def open(self, rtp: Processor, name: str, on: Source, apart: bool | str, contacts: int) -> PhysicalDevice:
        """Refuses to open the arm, which is not simulated and requires a driver."""
        refuse(
            CallError,
            f"'{self.name}' cannot be simulated without a model",
            f'pass its driver: load("{self.name}", driver=gpac.drivers.feetech(port))',
        )

    def kinematics(self, joints: list[str]) -> Kinematics:
        """Raises an error, because the geometry is unknown."""
        refuse(DefinitionError, f"the geometry of '{self.name}' is unknown", "load its URDF or MJCF file with the same driver")


BARE: Mapping[str, Bare] = {
    arm.name: arm
    for arm in [Bare("so101", ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"), "sts3215")]
}
"""Arms that have no model, by name."""
