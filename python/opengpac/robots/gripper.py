# SPDX-License-Identifier: Apache-2.0
"""A gripper of sliding fingers: each finger a logical device that is a spring of limited force and feels what it touches."""

from __future__ import annotations

from typing import Any

from .. import library as lib
from ..commands import activate, execute, ready
from ..devices import LogicalDevice, parameter, svv
from ..groups import Group
from ..parameters import input
from ..physical import PhysicalDevice
from ..sources import Source
from ..svvs import SVV
from ..verbs import Verb
from .servos import HISTORY, SERVO_PERIOD

finger_servo = Verb(
    "robot_finger_servo",
    doc="Holds a finger at its commanded position as a spring of limited force, and reads its touch sensor.",
    blocks={
        "position": lib.block("read_channel"),
        "speed": lib.block("read_channel"),
        "load": lib.block("read_channel"),
        "feel": lib.block("read_channel"),
        "servo": lib.block("compliant_servo"),
        "write": lib.block("write_channel"),
    },
    instantiation_parameters={
        "drive.position": "position.channel",
        "drive.velocity": "speed.channel",
        "drive.bias": "load.channel",
        "drive.effort": "write.channel",
        "touch": "feel.channel",
        "sensed": ["position.y", "servo.position"],
        "velocity": ["speed.y", "servo.velocity"],
        "force": "feel.y",
        "commanded": "servo.setpoint",
        "force_max": "servo.force_max",
    },
    cells={"bias": ["load.y", "servo.bias"], "effort": ["servo.effort", "write.u"]},
    input_parameters={"stiffness": input("servo.k", tunable=True), "damping": input("servo.d", tunable=True)},
    command_lists={
        "start": [
            execute("position"),
            activate("position", every=SERVO_PERIOD),
            activate("speed", every=SERVO_PERIOD),
            activate("load", every=SERVO_PERIOD),
            activate("feel", every=SERVO_PERIOD),
            activate("servo"),
            activate("write"),
            ready(),
        ]
    },
)


class Finger(LogicalDevice, verb=finger_servo, name="robot_finger"):
    """A sliding finger: position 0 where the fingers meet, more is open.

    `force` is what its pad feels, `force_max` the most that its spring exerts.
    """

    sensed: SVV[float] = svv(unit="m", history=HISTORY)
    velocity: SVV[float] = svv(unit="m/s")
    force: SVV[float] = svv(unit="N", history=HISTORY)
    commanded: SVV[float] = svv(unit="m", initial="sensed", history=HISTORY)
    force_max: SVV[float] = svv(unit="N", initial=0.5)
    stiffness: float = parameter(150.0, unit="N/m", tunable=True)
    damping: float = parameter(6.0, unit="N.s/m", tunable=True)


def gripper(device: PhysicalDevice, *parts: str, on: Source | None = None, name: str | None = None, **parameters: Any) -> Group[Finger]:
    """The fingers of a machine as a group, for `robots.load(..., tool="two_finger")`.

    `parts` are the machine's parts that are fingers, `left_finger` and `right_finger` where none is named; the touch sensor of each has
    its name. `on` runs their servos, else the source that exchanges with the machine. The group is `NAME`, else `DEVICE.hand`.
    """
    name = name or f"{device.name}.hand"
    fingers: list[Finger] = []
    try:
        for part in parts or ("left_finger", "right_finger"):
            made = Finger(f"{name}.{part}", drive=device[part], touch=device[f"sensor.{part}"], on=on or device.source, **parameters)
            fingers.append(made)
        return Group(name, *fingers)
    except BaseException:
        for finger in fingers:
            finger.delete()
        raise
