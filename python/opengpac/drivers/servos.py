# SPDX-License-Identifier: Apache-2.0
"""Servos on a serial bus, as used in student-built arms."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import CallError, refuse
from ..refusals.argument_types import taking
from ..values.quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def feetech(
    port: str | os.PathLike[str],
    servos: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    calibration: str | os.PathLike[str] | None = None,
    baud: int | None = None,
    max_speed: float | None = None,
    period: Quantity | None = None,
    age_max: Quantity | None = None,
    latency: Quantity | None = None,
    retries: int | None = None,
    echo: bool | None = None,
) -> Driver:
    """Feetech STS servos on the serial line `port`, `"/dev/ttyUSB0"`. Each servo is a joint that takes goals.

    `servos` is `{"elbow": {"id": 3, "model": "sts3215", "min": -1.5, "max": 1.5, "direction": -1, "zero": 2048}}`: only `id` is
    required, `min` and `max` are in rad, `zero` is in counts. `calibration` is a file of zeros and ranges in lerobot's format; with
    it `servos` may be omitted. A goal changes no faster than `max_speed` (3 rad/s). All servos are exchanged every `period` (10 ms);
    the device is lost if its readings are older than `age_max` (0.5 s), or a servo does not answer `retries` + 1 (3) requests, each
    within the time on the wire and `latency` (20 ms). With `echo`, the adapter echoes sent bytes; by default this is detected.

    Each joint has `position`, `velocity`, `load`, `current`, `voltage`, `temperature`, `status` (read) and `goal` (written). Its
    torque is on while a verb claims its goal, and off in the safe state.
    """
    times = {"period": period, "age_max": age_max, "latency": latency}
    return _driver("feetech", port, servos, calibration, times, baud=baud, max_speed=max_speed, retries=retries, echo=echo)


@taking
def dynamixel(
    port: str | os.PathLike[str],
    servos: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    calibration: str | os.PathLike[str] | None = None,
    baud: int | None = None,
    max_speed: float | None = None,
    period: Quantity | None = None,
    age_max: Quantity | None = None,
    latency: Quantity | None = None,
    retries: int | None = None,
    echo: bool | None = None,
    watchdog: Quantity | None = None,
) -> Driver:
    """Dynamixel X-series servos (protocol 2.0) on the serial line `port`; otherwise like `feetech`.

    `watchdog` (20 ms to 2.54 s in steps of 20 ms; none by default) is set in the servos themselves, from firmware 38 on: a servo with
    its torque on stops if the line is silent for that time, regardless of the state of this host, and the device is lost.

    The models are `xl330-m288`, `xl330-m077`, `xl430-w250`, `xc430-w150`, `xm430-w350`, `xm430-w210`, `xm540-w270` and `xm540-w150`,
    and `x` for any other; the default baud rate is 57600. A joint has `current` or `load`, whichever its model measures.
    """
    times = {"period": period, "age_max": age_max, "latency": latency, "watchdog": watchdog}
    return _driver("dynamixel", port, servos, calibration, times, baud=baud, max_speed=max_speed, retries=retries, echo=echo)


def _driver(
    kind: str,
    port: str | os.PathLike[str],
    servos: Mapping[str, Mapping[str, Any]] | None,
    calibration: str | os.PathLike[str] | None,
    times: Mapping[str, Quantity | None],
    **rest: Any,
) -> Driver:
    for name, servo in (servos or {}).items():
        if not isinstance(servo, Mapping):
            refuse(
                CallError, f"servo '{name}' of gpac.drivers.{kind}() must be a dictionary, not {servo!r}", 'write {"id": 1}, for example'
            )
    return Driver(
        kind,
        given(
            port=os.fspath(port),
            servos=None if servos is None else {name: dict(servo) for name, servo in servos.items()},
            calibration=None if calibration is None else str(Path(calibration).expanduser().absolute()),
            **{f"{name}_ns": optional_ns(time, name) for name, time in times.items()},
            **rest,
        ),
    )
