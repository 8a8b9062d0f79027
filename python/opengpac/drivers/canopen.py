# SPDX-License-Identifier: Apache-2.0
"""Drives on CANopen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import CallError, refuse
from ..given import taking
from ..quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def canopen(
    interface: str,
    axes: Mapping[str, Mapping[str, Any]],
    *,
    cycle: Quantity | None = None,
    timeout: Quantity | None = None,
    heartbeat: Quantity | None = None,
    lost_after: int | None = None,
    own_node: int | None = None,
) -> Driver:
    """Drives by CiA 402 on CANopen, an axis each: `gpac.drivers.canopen("can0", {"lift": {"node": 5, "counts": 409600, "unit": "m"}})`.

    Each axis is a name with its options. `node`: its number on the bus, 1 to 127. `counts`: how many counts of its encoder are one unit of
    position, negative to turn it round. `mode`: `position` (default), `velocity` or `torque`. `unit`: `rad` (default) or `m`. `offset`:
    counts at position 0. `speed_max`, `range`: its limits. `rated_torque`: N.m or N, needed in mode `torque`. `watchdog`: False for a
    drive that cannot watch for its controller.

    Channels of an axis: `position`, `velocity`, `torque`, `status`, `error` (read), and `goal`, `rate` or `effort` (written), by its mode.
    An axis is switched on by CiA 402 when its written channel is engaged, and never leaps: its target begins where it is and changes by
    `speed_max` at most. `cycle` (10 ms) is the period of the source that exchanges it, which the drives are told. `timeout` (100 ms) is
    the watchdog of the drives: without the heartbeat of this controller for so long they stop by themselves. `heartbeat` (100 ms) is how
    often a drive says that it is there; the third that is missed, or `lost_after` (3) cycles without process data, lose the device.
    `own_node` (127) is the number of this controller. `interface` is one of SocketCAN, that of an emulated bus,
    `gpac.drivers.fake.canopen`, or `"emulated"`: a bus of its own with a drive for each axis.
    """
    for name, axis in axes.items():
        if not isinstance(axis, Mapping):
            refuse(CallError, f"axis '{name}' is given {axis!r}", 'give a dictionary: {"node": 5, "counts": 10000}')
    return Driver(
        "canopen",
        given(
            interface=interface,
            axes=[{"name": name, **axis} for name, axis in axes.items()],
            cycle_ns=optional_ns(cycle, "the cycle"),
            timeout_ns=optional_ns(timeout, "the timeout"),
            heartbeat_ns=optional_ns(heartbeat, "the heartbeat"),
            lost_after=lost_after,
            own_node=own_node,
        ),
    )
