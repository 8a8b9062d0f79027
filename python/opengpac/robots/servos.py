# SPDX-License-Identifier: Apache-2.0
"""Servo of a joint: a servo on this host, or a drive that closes the loop itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .. import library as lib
from ..definition.commands import activate, execute, ready
from ..definition.conditions import on
from ..definition.graphs import Graph
from ..definition.parameters import input
from ..definition.verbs import Verb
from ..errors import Terminated


class FollowingError(Terminated):
    """The distance of a joint from its commanded position exceeds `max_following_error`.

    `value` is the error, the desired position minus the measured one. `outputs` contains `error_limit` (`max_following_error`),
    `time_lost` (s, because of releases skipped just before), and for a servo on this host `effort` and `effort_limit` (`max_effort`);
    for a simulated joint also `motor_effort` and `motor_limit`: the effort of its motor, which includes gravity and the other joints,
    and its maximum.
    """


class ServoUnstable(Terminated):
    """The servo of a joint oscillates: its effort between the limits, or its position about the commanded one.

    `value` is the frequency, Hz. An oscillation is reported if its frequency is at least `unstable_from` for ten consecutive periods,
    and if the error exceeds half of `max_following_error` in both directions, the effort reaches both its limits, or a joint
    commanded to rest moves by `max_ripple`.
    """


SERVO_PERIOD = "1 ms"
"""Period of the servo."""

MAX_GAP = 0.5
"""Maximum gap in time, s; after a larger gap a moving joint is braked from its current position."""

HISTORY = 10_000
"""Number of values of `sensed`, `commanded` and `reference` that are kept: ten seconds of servo invocations."""

reading = Graph(
    "joint_position",
    doc="Position of a joint: its channel, counted from the zero that homing found.",
    blocks={"read": lib.block("read_channel"), "zero": lib.block("offset")},
    inputs={"offset": "zero.offset"},
    outputs={"y": "zero.y"},
    cells={"reading": ["read.y", "zero.u"]},
)


def _kept(label: str, velocity: str | list[str]) -> dict[str, str | list[str]]:
    """Returns χ of a block that keeps a joint at its commanded position. `velocity` names the ports that store and read the joint's
    speed."""
    return {
        "offset": ["position.offset", f"{label}.offset"],
        "sensed": ["position.y", f"{label}.position"],
        "velocity": velocity,
        "commanded": f"{label}.setpoint",
        # Values of the last set-point, and the block's braking if no other one follows.
        **{name: f"{label}.{name}" for name in ("setpoint_velocity", "setpoint_acceleration", "setpoint_time", "braking")},
        "reference": f"{label}.reference",
        "commanded_velocity": f"{label}.reference_velocity",
        "limited": f"{label}.limited",
        "homed": f"{label}.homed",
    }


_SERVO_SAYS = {"error_limit": "servo.error_max", "effort": "servo.effort", "effort_limit": "servo.limit", "time_lost": "servo.lost"}
"""Values that a servo returns with a following error; the error message includes them."""

_DECOUPLED_SAYS = _SERVO_SAYS | {"motor_effort": "motor.y", "motor_limit": "strongest.y"}
"""Values for a drive that compensates for the other joints: those of a servo, and the effort of its motor and its maximum."""

_FOLLOWER_SAYS = {"error_limit": "follow.error_max", "time_lost": "follow.lost"}
"""Values for a drive that closes the loop itself; its effort is not known here."""


def _ends(says: Mapping[str, str]) -> dict[str, Any]:
    """Returns the conditions that end a servo on this host. `says` maps the outputs that a following error returns to ports."""
    return {
        "following_error": on("servo.following_error", returns=list(says), raises=FollowingError),
        "servo_unstable": on("servo.unstable", raises=ServoUnstable),
    }


joint_servo = Verb(
    "robot_joint_servo",
    doc="Holds a joint at its commanded position, within its range and maximum speed: PID with the plant's gravity compensation.",
    blocks={
        "position": reading,
        "speed": lib.block("read_channel"),
        "load": lib.block("channel_sum"),
        "servo": lib.block("joint_servo"),
        "write": lib.block("write_channel"),
    },
    instantiation_parameters={
        "drive.position": "position.read.channel",
        "drive.velocity": "speed.channel",
        "drive.bias": "load.channel",
        "load_effort": "load.u",
        "drive.effort": "write.channel",
        **_kept("servo", ["speed.y", "servo.velocity"]),
    },
    cells={"bias": ["load.y", "servo.bias"], "effort": ["servo.effort", "write.u"]},
    input_parameters={
        "kp": input("servo.kp", tunable=True),
        "ki": input("servo.ki", tunable=True),
        "kd": input("servo.kd", tunable=True),
        "max_effort": "servo.limit",
        "max_speed": "servo.speed_max",
        "max_acceleration": "servo.acceleration_max",
        "max_jerk": "servo.jerk_max",
        "position_min": "servo.position_min",
        "position_max": "servo.position_max",
        "needs_home": "servo.needs_home",
        "max_following_error": "servo.following_error",
        "unstable_from": input("servo.unstable", default=5.0),
        "max_ripple": input("servo.ripple_max", default=0.0),
        "max_gap": input("servo.gap", default=MAX_GAP, tunable=True),
    },
    command_lists={
        "start": [
            execute("position"),
            activate("position", every=SERVO_PERIOD),
            activate("speed", every=SERVO_PERIOD),
            activate("load", every=SERVO_PERIOD),
            activate("servo"),
            activate("write"),
            ready(),
        ]
    },
    output_values=_SERVO_SAYS,
    conditions=_ends(_SERVO_SAYS),
)


def _decoupled(name: str, doc: str, motor: Mapping[str, str], says: Mapping[str, str]) -> Verb[..., Any]:
    """Returns the verb of a servo on a drive with the arm's dynamics. `motor` maps the blocks that read the drive's motor values to
    their channels."""
    return Verb(
        name,
        doc=doc,
        blocks={
            "position": reading,
            "speed": lib.block("read_channel"),
            "servo": lib.block("joint_servo"),
            "write": lib.block("write_channel"),
            "load": lib.block("write_channel"),
            **{block: lib.block("read_channel") for block in motor},
        },
        instantiation_parameters={
            "drive.position": "position.read.channel",
            "drive.velocity": "speed.channel",
            **{f"drive.{channel}": f"{block}.channel" for block, channel in motor.items()},
            "drive.decoupled": "write.channel",
            "drive.effort": "load.channel",
            "load_effort": "load.u",
            **_kept("servo", ["speed.y", "servo.velocity"]),
        },
        cells={"effort": ["servo.effort", "write.u"]},
        modes={"load.u": "asynchronous"},
        input_parameters=joint_servo.input_parameters,
        command_lists={
            "start": [
                execute("position"),
                activate("position", every=SERVO_PERIOD),
                activate("speed", every=SERVO_PERIOD),
                *(activate(block, every=SERVO_PERIOD) for block in motor),
                activate("load", every=SERVO_PERIOD),
                activate("servo"),
                activate("write"),
                ready(),
            ]
        },
        output_values=says,
        conditions=_ends(says),
    )


_DECOUPLED_DOC = (
    "Holds a joint at its commanded position, within its range and maximum speed: PID on a drive that compensates the arm's dynamics."
)

joint_decoupled_servo = _decoupled(
    "robot_joint_decoupled_servo", _DECOUPLED_DOC, {"motor": "motor_effort", "strongest": "motor_limit"}, _DECOUPLED_SAYS
)
"""Verb that keeps a joint running if its drive compensates for gravity and the other joints (computed torque), as in a simulated arm."""

quiet_decoupled_servo = _decoupled("robot_joint_quiet_decoupled_servo", _DECOUPLED_DOC, {}, _SERVO_SAYS)
"""Variant for a drive that does not report the effort and the limit of its motor: a following error returns the servo's values instead."""


joint_follower = Verb(
    "robot_joint_follower",
    doc="Sends the commanded position of a joint, within its range and maximum speed, to a drive that closes the loop itself.",
    blocks={
        "position": reading,
        "speed": lib.block("read_channel"),
        "follow": lib.block("joint_reference"),
        "write": lib.block("write_channel"),
    },
    instantiation_parameters={
        "drive.position": "position.read.channel",
        "drive.velocity": "speed.channel",
        "drive.goal": "write.channel",
        **_kept("follow", ["speed.y", "follow.velocity"]),
    },
    cells={"goal": ["follow.goal", "write.u"]},
    input_parameters={
        "max_speed": "follow.speed_max",
        "max_acceleration": "follow.acceleration_max",
        "max_jerk": "follow.jerk_max",
        "position_min": "follow.position_min",
        "position_max": "follow.position_max",
        "needs_home": "follow.needs_home",
        "max_following_error": "follow.following_error",
        "max_gap": input("follow.gap", default=MAX_GAP, tunable=True),
    },
    command_lists={
        "start": [
            execute("position"),
            activate("position", every=SERVO_PERIOD),
            activate("speed", every=SERVO_PERIOD),
            activate("follow"),
            activate("write"),
            ready(),
        ]
    },
    output_values=_FOLLOWER_SAYS,
    conditions={"following_error": on("follow.following_error", returns=list(_FOLLOWER_SAYS), raises=FollowingError)},
)
"""Verb that keeps a joint running if its drive takes positions, that is, if the servo is in the machine."""
