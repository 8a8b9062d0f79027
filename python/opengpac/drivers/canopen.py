# SPDX-License-Identifier: Apache-2.0
"""Drives on CANopen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..errors import CallError, refuse
from ..refusals.argument_types import taking
from ..values.quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def canopen(
    interface: str,
    axes: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
    *,
    modules: Mapping[str, Mapping[str, Any]] | None = None,
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
    drive that cannot watch for its controller. `pdos`: `device` where the drive's own process data are to be used, `written` (default)
    where the driver writes them. `brake`: the output of a brake that the drive does not serve by itself, `{}` or
    `{'bit': 1, 'released_by_one': True}`. `operating_within_s` (3): how long the drive may take to come into operation once it is engaged;
    then the device is lost, and the drive stays off. `eds`: the path of its electronic data sheet, whose vendor and product it must
    have, and by whose names services find its objects. `vendor`, `product`, `revision`, `serial`: the identity that its node is to have,
    as a scan shows it; a node that is another one, by these or by the first opening, is named and nothing is configured.

    `modules` are modules of inputs and outputs by CiA 401, each with `node`, `channels`, and `watchdog`, `eds` and the identity as an axis
    has them: `{"io": {"node": 7, "channels": {"door": {"input": 0}, "lamp": {"output": 3}, "pressure": {"analog_input": 0, "scale": 0.001,
    "unit": "bar"}}}}`. A channel is `input`, `output` (digital, terminals 0 to 63), `analog_input` or `analog_output` (0 to 11); the value
    of an analog one is counts × `scale` + `offset`, in `unit`. `safe`: what an output carries while it is not commanded (off, or 0
    counts). The module's `error` is the code of its latest emergency; `device["io.door"]` is a channel.

    Channels of an axis: `position`, `velocity`, `torque`, `status`, `error`, `homing`, `operating` (read), and `goal`, `rate` or `effort`
    (written), by its mode. `enable` and verbs wait for `operating`.
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
    for name, module in (modules or {}).items():
        if not isinstance(module, Mapping):
            refuse(CallError, f"module '{name}' is given {module!r}", 'give a dictionary: {"node": 7, "channels": {"door": {"input": 0}}}')
    return Driver(
        "canopen",
        given(
            interface=interface,
            axes=_paths({"name": name, **axis} for name, axis in axes.items()),
            modules=_paths({"name": name, **module} for name, module in (modules or {}).items()),
            cycle_ns=optional_ns(cycle, "the cycle"),
            timeout_ns=optional_ns(timeout, "the timeout"),
            heartbeat_ns=optional_ns(heartbeat, "the heartbeat"),
            lost_after=lost_after,
            own_node=own_node,
        ),
    )


def _paths(nodes: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns the nodes with the paths of data sheets as another process finds them."""
    return [{**node, "eds": str(Path(node["eds"]).resolve())} if node.get("eds") is not None else node for node in nodes]
