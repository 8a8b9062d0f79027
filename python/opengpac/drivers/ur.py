# SPDX-License-Identifier: Apache-2.0
"""Universal Robots arms."""

from __future__ import annotations

from ..refusals.argument_types import taking
from ..values.quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def ur(
    host: str,
    *,
    power_on: bool | None = None,
    wait: Quantity | None = None,
    silence: Quantity | None = None,
    timeout: Quantity | None = None,
    speed_max: float | None = None,
    lookahead: float | None = None,
    gain: float | None = None,
    deceleration: float | None = None,
    rtde_port: int | None = None,
    dashboard_port: int | None = None,
    script_port: int | None = None,
) -> Driver:
    """A Universal Robots arm (e-Series and later) over RTDE: `gpac.robots.load("ur5e", driver=gpac.drivers.ur("192.0.2.10"))`.

    Its joints take positions, which a program on its controller follows (`servoj` with `lookahead` s and `gain`); each must be within
    `speed_max` (rad/s) of the previous one. Without a command for `timeout` (40 ms) the controller brings the arm to rest by itself,
    with `deceleration` (rad/s²); without a package for `silence` (100 ms) the arm is `device_lost`. `wait` (10 s; 70 s with
    `power_on`) is the time limit until the arm follows, including the start of its controller. `power_on` powers the arm on and
    releases its brakes. Further channels: `tool.force`, `tool.torque`, `speed_scaling`, `io.in0` to `io.in7`, `io.out0` to `io.out7`,
    `io.analog_in0` and `io.analog_in1`.
    """
    return Driver(
        "ur",
        given(
            host=host, power_on=power_on, wait_ns=optional_ns(wait, "the time to wait"), silence_ns=optional_ns(silence, "the silence"),
            timeout_ns=optional_ns(timeout, "the timeout"), speed_max=speed_max, lookahead=lookahead, gain=gain, deceleration=deceleration,
            rtde_port=rtde_port, dashboard_port=dashboard_port, script_port=script_port,
        ),
    )  # fmt: skip
