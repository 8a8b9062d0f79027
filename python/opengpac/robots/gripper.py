# SPDX-License-Identifier: Apache-2.0
"""Gripper with prismatic fingers: each finger is a logical device that acts as a spring of limited force and senses contact."""

from __future__ import annotations

from typing import Any

from .. import library as lib
from ..definition.commands import activate, execute, ready
from ..definition.parameters import input
from ..definition.verbs import Verb
from ..devices.groups import Group
from ..devices.logical import LogicalDevice, parameter, svv
from ..devices.physical import PhysicalDevice
from ..system.sources import Source
from ..system.svvs import SVV
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


finger_follower = Verb(
    "robot_finger_follower",
    doc="Sends the position and maximum force of a finger to a gripper that closes the loop itself, and reads its touch sensor.",
    blocks={
        "position": lib.block("read_channel"),
        "speed": lib.block("read_channel"),
        "feel": lib.block("read_channel"),
        "goal": lib.block("write_channel"),
        "limit": lib.block("write_channel"),
    },
    instantiation_parameters={
        "position": "position.channel",
        "speed": "speed.channel",
        "touch": "feel.channel",
        "goal": "goal.channel",
        "limit": "limit.channel",
        "sensed": "position.y",
        "velocity": "speed.y",
        "force": "feel.y",
        "commanded": "goal.u",
        "force_max": "limit.u",
    },
    modes={"goal.u": "asynchronous", "limit.u": "asynchronous"},
    command_lists={
        "start": [
            execute("position"),
            *(activate(label, every=SERVO_PERIOD) for label in ("position", "speed", "feel", "goal", "limit")),
            ready(),
        ]
    },
)
"""Verb that keeps a finger running if the gripper itself closes the loop."""


class Finger(LogicalDevice, verb=finger_servo, name="robot_finger"):
    """A prismatic finger. Its position is 0 where the fingers meet, and increases as they open.

    `force` is the contact force of its pad, `force_max` the maximum force of its spring.
    """

    sensed: SVV[float] = svv(unit="m", history=HISTORY)
    velocity: SVV[float] = svv(unit="m/s")
    force: SVV[float] = svv(unit="N", history=HISTORY)
    commanded: SVV[float] = svv(unit="m", initial="sensed", history=HISTORY)
    force_max: SVV[float] = svv(unit="N", initial=0.5, within="[0, inf)")
    stiffness: float = parameter(150.0, unit="N/m", tunable=True, within="[0, inf)")
    damping: float = parameter(6.0, unit="N.s/m", tunable=True, within="[0, inf)")


def gripper(device: PhysicalDevice, *parts: str, on: Source | None = None, name: str | None = None, **parameters: Any) -> Group[Finger]:
    """Returns the fingers of the machine `device` as a group, for `robots.load(..., tool="two_finger")`.

    `parts` are the machine's parts that are fingers, by default `left_finger` and `right_finger`; the touch sensor of each has the
    same name. `on` runs their servos, by default the source that exchanges with the machine. The group is called `name`, by default
    `DEVICE.hand`.

    A gripper that is a separate device and closes the loops itself has the channels `PART.position`, `PART.velocity` and `PART.force`
    (read), `PART.goal` and `PART.force_max` (written), and its fingers follow with its own stiffness. Any driver can be used, for
    example `gpac.drivers.modbus` with these names.
    """
    name = name or f"{device.name}.hand"
    fingers: list[Finger] = []
    try:
        for part in parts or ("left_finger", "right_finger"):
            fingers.append(Finger(f"{name}.{part}", on=on or device.source, **_driven(device, part), **parameters))
        return Group(name, *fingers)
    except BaseException:
        for finger in fingers:
            finger.delete()
        raise


def _driven(device: PhysicalDevice, part: str) -> dict[str, Any]:
    """Returns the arguments of a finger for its drive: its verb, if it is not the type's own, and its channels."""
    if f"{part}.goal" not in device.channels:
        return {"drive": device[part], "touch": device[f"sensor.{part}"]}
    words = {"position": "position", "speed": "velocity", "touch": "force", "goal": "goal", "limit": "force_max"}
    return {"verb": finger_follower, **{word: device[f"{part}.{channel}"] for word, channel in words.items()}}
