# SPDX-License-Identifier: Apache-2.0
"""Properties that a joint takes from the part that drives it: its verb, its units, its limits and its interval."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..definition.verbs import Verb
from ..devices.physical import Part
from ..drivers.driver import UNLIMITED
from ..errors import CallError, refuse
from ..system.sources import Source
from ..values.quantities import Quantity, duration_ns
from .servos import SERVO_PERIOD, joint_decoupled_servo, joint_follower, joint_servo, quiet_decoupled_servo

JOG_SPEED = 0.25
"""Default jog speed of a joint, rad/s."""

MAX_RIPPLE = 4e-3
"""Peak-to-peak ripple at rest above which a servo is considered unstable, rad: just above two counts of a twelve-bit encoder, 3.1 mrad."""

SIMULATED_RIPPLE = {"rad": 1e-3, "m": 1e-4}
"""Ripple limit of a simulated joint, whose readings have no noise."""

INTEGRAL_SHARE = 4.0 / 27.0
"""Integral gain of a decoupled servo, as a fraction of kp times its bandwidth: the maximum value without oscillating poles."""

FASTEST = 100.0
"""Maximum plausible speed of a joint, rad/s or m/s; higher limits in a model are reduced to it."""

QUICKEST = 1e4
"""Maximum plausible acceleration, rad/s² or m/s²: a joint limited to `FASTEST` reaches that speed in 10 ms."""

JERKIEST = 1e7
"""Maximum plausible jerk, rad/s³ or m/s³: a joint limited to `QUICKEST` reaches that acceleration in 1 ms."""

LEAST_LIMIT = 1e-5
"""Minimum for a limit of speed, acceleration and jerk, so that a fraction of it is still valid for a motion."""

_SLIDING = {"max_speed": 0.25, "jog_speed": 0.05, "max_acceleration": 1.0, "max_jerk": 10.0, "max_ripple": 4e-4}
"""Default limits of prismatic joints, in m."""


def suited(joint: str, drive: Part, on: Source, given: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the arguments of a joint that this part drives: those that the program sets, and for the others those that the driver
    declares."""
    verb = _keeper(joint, drive, given.get("verb"))
    words: dict[str, Any] = {"verb": verb, "units": _units(drive), "every": _pace(verb, on)}
    given = {name: value for name, value in given.items() if name not in words or value is not None}
    found = words | _limits(drive, verb) | given
    fastest = found.get("max_speed")
    if isinstance(fastest, int | float) and "jog_speed" not in given:
        found["jog_speed"] = min(fastest, found.get("jog_speed", JOG_SPEED))
    return found


def integral_gain(drive: Part) -> float:
    """Returns the integral gain that compensates for friction and mimic joints, which the equations of a drive do not include; 0 for
    other drives."""
    gains = drive.about.get("decoupled")
    # The loop is critically damped, so the bandwidth is 2 kp / kd.
    return INTEGRAL_SHARE * gains["kp"] * 2.0 * gains["kp"] / gains["kd"] if gains and gains["kd"] > 0.0 else 0.0


def _keeper(joint: str, drive: Part, verb: Verb[..., Any] | None) -> Verb[..., Any] | None:
    """Returns `joint_follower` for a drive that takes positions, and `joint_decoupled_servo` for a drive with the arm's dynamics.
    Returns None, that is, the type's own verb, for a drive that only takes efforts. Refuses drives that lack a channel."""
    suits = joint_follower if _takes_positions(drive) else _decoupled(drive) if "decoupled" in drive.about else joint_servo
    chosen = verb or suits
    lacking = _lacking(drive, chosen)
    if lacking:
        written = ", ".join(f"'{name}'" for name, channel in drive.channels.items() if channel.write) or "none"
        refuse(
            CallError,
            f"verb '{chosen.name}' cannot servo joint '{joint}': it needs channel '{lacking[0]}' of part "
            f"'{drive.device.name}.{drive.name}', whose written channels are {written}",
            f"omit verb= to use '{suits.name}'"
            if chosen is not suits and not _lacking(drive, suits)
            else "pass a part that takes positions ('goal') or efforts ('effort'), or your own verb for this part as verb=",
        )
    return verb if verb is not None else suits if suits is not joint_servo else None


def _decoupled(drive: Part) -> Verb[..., Any]:
    """Returns `joint_decoupled_servo`, or its variant without the motor's values if the drive does not report them."""
    tells_motor = {"motor_effort", "motor_limit"} <= set(drive.channels)
    return joint_decoupled_servo if tells_motor else quiet_decoupled_servo


def _takes_positions(drive: Part) -> bool:
    return drive.about.get("command") == "position"


def _lacking(drive: Part, verb: Verb[..., Any]) -> list[str]:
    needed = [word.removeprefix("drive.") for word in verb.instantiation_parameters if word.startswith("drive.")]
    return [channel for channel in needed if channel not in drive.channels]


def _units(drive: Part) -> dict[str, str] | None:
    return {"N.m": "N", "rad": "m"} if drive.about["unit"] == "m" else None


def _limits(drive: Part, verb: Verb[..., Any] | None) -> dict[str, Any]:
    about = drive.about
    found = {
        "home": about["home"],
        "position_min": about["range_min"],
        "position_max": about["range_max"],
        "max_effort": about["effort_max"],
    }
    if about["unit"] == "m":
        found |= _SLIDING
    if about.get("speed_max", UNLIMITED) < UNLIMITED:
        found["max_speed"] = min(about["speed_max"], FASTEST)
    if "acceleration_max" in about:
        found["max_acceleration"] = min(about["acceleration_max"], QUICKEST)
    if _takes_positions(drive):
        found.pop("max_ripple", None)
        return found
    if "decoupled" in about:
        found["max_ripple"] = SIMULATED_RIPPLE[about["unit"]]
    gains = about["decoupled" if verb in (joint_decoupled_servo, quiet_decoupled_servo) else "servo"]
    return found | {name: gains[name] for name in ("kp", "kd")}


def _pace(verb: Verb[..., Any] | None, on: Source) -> dict[str, Quantity] | None:
    """Returns the intervals for a drive that closes its loop itself. It can be commanded less often than a servo would run: at the
    period of its source."""
    if verb is not joint_follower or on.period is None or on.period <= duration_ns(SERVO_PERIOD, "the servo's period") * 1e-9:
        return None
    return {"position": on.period, "speed": on.period}
