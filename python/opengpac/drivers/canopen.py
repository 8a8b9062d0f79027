# SPDX-License-Identifier: Apache-2.0
"""CANopen drives."""

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
    """CiA 402 drives on CANopen, one axis each: `gpac.drivers.canopen("can0", {"lift": {"node": 5, "counts": 409600, "unit": "m"}})`.

    Each of `axes` is a name with its options. `node`: its node ID, 1 to 127. `counts`: encoder counts per unit of position, negative
    to reverse the direction. `mode`: `position` (default), `velocity` or `torque`. `unit`: `rad` (default) or `m`. `offset`: counts
    at position 0. `speed_max`, `range`: its limits. `rated_torque`: N.m or N, required in mode `torque`. `watchdog`: False for a
    drive that cannot monitor its controller. `pdos`: `device` to use the PDO mapping stored in the drive, `written` (default) to have
    the driver write it. `brake`: the output of a brake that the drive does not operate itself, `{}` or `{'bit': 1, 'released_by_one':
    True}`. `operating_within_s` (3): time limit for the drive to become operational once it is engaged; after that, the device is
    lost, and the drive stays off. `eds`: path of the drive's electronic data sheet, whose vendor and product must match, and whose
    names services use to look up object dictionary entries. `vendor`, `product`, `revision`, `serial`: the required identity of the
    node, as shown by a scan; a node that differs from these or from the node first opened is reported and nothing is configured.

    `modules` are CiA 401 input and output modules, each with `node`, `channels`, and `watchdog`, `eds` and the identity as for an
    axis: `{"io": {"node": 7, "channels": {"door": {"input": 0}, "lamp": {"output": 3}, "pressure": {"analog_input": 0, "scale":
    0.001, "unit": "bar"}}}}`. A channel is `input`, `output` (digital, terminals 0 to 63), `analog_input` or `analog_output` (0 to
    11); the value of an analog channel is counts × `scale` + `offset`, in `unit`. `safe`: the value of an output while it is not
    commanded (off, or 0 counts). The module's `error` is the code of its latest emergency message; `device["io.door"]` is a channel.

    Channels of an axis: `position`, `velocity`, `torque`, `status`, `error`, `homing`, `operating` (read), and `goal`, `rate` or
    `effort` (written), depending on its mode. `enable` and verbs wait for `operating`. An axis is switched on through the CiA 402
    state machine when its written channel is engaged, and never jumps: its target starts at its actual position and changes no faster
    than `speed_max`. `cycle` (10 ms) is the period of the source that exchanges it, which is sent to the drives. `timeout` (100 ms)
    is the watchdog of the drives: without the heartbeat of this controller for that time they stop of their own accord. `heartbeat`
    (100 ms) is the heartbeat interval of the drives; the device is lost after the third missed heartbeat, or after `lost_after` (3)
    cycles without process data. `own_node` (127) is the node ID of this controller. `interface` is a SocketCAN interface, the
    interface of an emulated bus, `gpac.drivers.fake.canopen`, or `"emulated"`: a separate bus with a drive for each axis.
    """
    for name, axis in axes.items():
        if not isinstance(axis, Mapping):
            refuse(CallError, f"axis '{name}' must be a dictionary, not {axis!r}", 'write {"node": 5, "counts": 10000}, for example')
    for name, module in (modules or {}).items():
        if not isinstance(module, Mapping):
            refuse(
                CallError,
                f"module '{name}' must be a dictionary, not {module!r}",
                'write {"node": 7, "channels": {"door": {"input": 0}}}, for example',
            )
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
    """Returns the nodes with absolute paths of their data sheets, so that they are valid in another process."""
    return [{**node, "eds": str(Path(node["eds"]).resolve())} if node.get("eds") is not None else node for node in nodes]
