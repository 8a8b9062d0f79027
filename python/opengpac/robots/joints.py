# SPDX-License-Identifier: Apache-2.0
"""Joint of an arm, or a single axis, as a logical device."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..definition.verbs import Verb
from ..devices.logical import LogicalDevice, parameter, svv
from ..devices.physical import Part
from ..system.sources import Source
from ..system.svvs import SVV
from ..system.system import System
from ..values.quantities import Quantity
from .drives import FASTEST, JERKIEST, JOG_SPEED, LEAST_LIMIT, MAX_RIPPLE, QUICKEST, suited
from .servos import HISTORY, MAX_GAP, joint_servo

_logger = logging.getLogger("opengpac")

OUTSIDE = {"rad": 1e-3, "m": 1e-4}
"""Distance beyond its range at which a joint is reported."""


class Joint(LogicalDevice, verb=joint_servo, name="robot_joint"):
    """A joint of an arm: positions in rad (m for a prismatic joint), efforts in N.m (N).

    `commanded` is the set-point stored by a verb; `reference` and `commanded_velocity` are the servo's current target, which follows
    the set-points smoothly and stays within `position_min`, `position_max` and `max_speed`; `limited` counts the servo's invocations
    in which these limits were active. `setpoint_velocity`, `setpoint_acceleration` and `setpoint_time` (ns of the system's clock)
    belong to the latest set-point: a motion that takes over continues from there. If no motion commands a moving joint, its servo
    brakes it within `max_acceleration` and `max_jerk`, beyond `commanded`, and the next motion starts there: `braking` contains the
    distance, the speed, its rate of change, and the start time (ns); all are 0 while set-points arrive. If more than `max_gap` is
    lost in one gap, because releases were skipped, the joint comes to rest from its current position, stays enabled, and its users
    end with `TimeLost`. `override` (0 to 1) scales the speed of the verbs of `gpac.motion`, `cell_override` is the override of the
    whole cell. A joint with `needs_home=True` is not `homed` until `gpac.motion.home` has found its zero, which is `offset`.

    `Joint("lift", drive=line["lift"])` is a single joint. The driver's declarations of the part are the defaults: its unit, range,
    speed, effort and gains, and the source that exchanges with it. If the part takes positions (EtherCAT axes, serial servos,
    Universal Robots arms), the joint's verb is `joint_follower`, which ignores gains and `load_effort`; if the part takes efforts, it
    is `joint_servo`. `verb` replaces either.
    """

    sensed: SVV[float] = svv(unit="rad", history=HISTORY, reading=True)
    velocity: SVV[float] = svv(unit="rad/s", reading=True)
    commanded: SVV[float] = svv(unit="rad", initial="sensed", history=HISTORY, within=("position_min", "position_max"))
    commanded_velocity: SVV[float] = svv(unit="rad/s")
    # Without units, the values of the last set-point persist when its motion ends, unlike a command that keeps driving.
    setpoint_velocity: SVV[float] = svv()
    setpoint_acceleration: SVV[float] = svv()
    setpoint_time: SVV[int] = svv()
    braking: SVV[np.ndarray] = svv("double[4]")
    reference: SVV[float] = svv(unit="rad", history=HISTORY)
    goal: SVV[float] = svv(unit="rad", initial="sensed", within=("position_min", "position_max"))
    limited: SVV[int] = svv()
    offset: SVV[float] = svv(unit="rad", keep=True)
    homed: SVV[bool] = svv()
    override: SVV[float] = svv(initial=1.0, within=(0.0, 1.0))
    cell_override: SVV[float] = svv(initial=1.0, within=(0.0, 1.0), shared="override")
    needs_home: bool = parameter(False)
    load_effort: SVV[float] = svv(unit="N.m", initial=0.0, within=("-max_effort", "max_effort"))
    home: float = parameter(0.0, unit="rad")
    position_min: float = parameter(-1e6, unit="rad", within=(-1e9, "position_max"))
    position_max: float = parameter(1e6, unit="rad", within=("position_min", 1e9))
    max_speed: float = parameter(3.14, unit="rad/s", within=f"[{LEAST_LIMIT:g}, {FASTEST:g}]")
    jog_speed: float = parameter(JOG_SPEED, unit="rad/s", within=f"[{LEAST_LIMIT:g}, {FASTEST:g}]")
    max_acceleration: float = parameter(5.0, unit="rad/s^2", within=f"[{LEAST_LIMIT:g}, {QUICKEST:g}]")
    max_jerk: float = parameter(50.0, unit="rad/s^3", within=f"[{LEAST_LIMIT:g}, {JERKIEST:g}]")
    max_gap: float = parameter(MAX_GAP, unit="s", tunable=True, within="(0, inf)")
    max_effort: float = parameter(150.0, unit="N.m", within="[0, inf)")
    max_following_error: float = parameter(0.1, unit="rad", within="[0, inf)")
    unstable_from: float = parameter(5.0, unit="Hz", within="[0, inf)")
    max_ripple: float = parameter(MAX_RIPPLE, unit="rad", within="[0, inf)")
    kp: float = parameter(100.0, unit="N.m/rad", tunable=True, within="[0, inf)")
    ki: float = parameter(0.0, unit="N.m/rad/s", tunable=True, within="[0, inf)")
    kd: float = parameter(10.0, unit="N.m.s/rad", tunable=True, within="[0, inf)")

    def __init__(
        self,
        name: str,
        *,
        drive: Part | None = None,
        on: Source | None = None,
        system: System | None = None,
        every: Mapping[str, Quantity] | None = None,
        units: Mapping[str, str] | None = None,
        arbitration: str | None = None,
        verb: Verb[..., Any] | None = None,
        **arguments: Any,
    ) -> None:
        arguments |= {"every": every, "units": units, "verb": verb}
        if isinstance(drive, Part):
            on = on or drive.device.source
            arguments = suited(name, drive, on, arguments)
        if drive is not None:
            arguments["drive"] = drive
        super().__init__(name, on=on, system=system, arbitration=arbitration, **arguments)

    def _when_enabled(self) -> None:
        """Warns about a joint outside its range, and names the motion that returns it to its range."""
        position, low, high = self.sensed.value, self.position_min, self.position_max
        unit = self.sensed.unit or "rad"
        if self.needs_home or max(low - position, position - high) <= OUTSIDE.get(unit, 0.0):
            return
        _logger.warning(
            "joint '%s' is at %.6g %s, outside its range, %.6g to %.6g %s, and stays there; move it back with "
            "gpac.motion.return_to_range(…), at a tenth of its speed",
            self.name, position, unit, low, high, unit,
        )  # fmt: skip
