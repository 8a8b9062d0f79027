# SPDX-License-Identifier: Apache-2.0
"""EtherCAT drives."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ..errors import CallError, refuse
from ..refusals.argument_types import taking
from ..values.quantities import Quantity, optional_ns
from . import esi
from .driver import Driver, given


@taking
def ethercat(
    interface: str,
    axes: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
    *,
    terminals: Mapping[str, Mapping[str, Any]] | None = None,
    timeout: Quantity | None = None,
    lost_after: int | None = None,
    sync0: Quantity | None = None,
    sync0_shift: Quantity | None = None,
) -> Driver:
    """CiA 402 drives on EtherCAT, one axis each: `gpac.drivers.ethercat("eth1", {"lift": {"counts": 131072 / 0.01, "unit": "m"}})`.

    Each of `axes` is a name with its options. `counts`: encoder counts per unit of position, negative to reverse the direction. `at`:
    its position on the line (by default its index here). `mode`: `position` (default), `velocity` or `torque`. `unit`: `rad`
    (default) or `m`. `offset`: counts at position 0. `speed_max`, `range`: its limits. `rated_torque`: N.m or N, required in mode
    `torque`. `pdos`: `device` to use the PDO mapping stored in the drive, `written` (default) to have the driver write it. `brake`:
    the output of a brake that the drive does not operate itself, `{}` or `{'bit': 1, 'released_by_one': True}`. `operating_within_s`
    (3): time limit for the drive to become operational once it is engaged; after that, the device is lost, and the drive stays off.
    `vendor`, `product`, `revision`, `serial`, `alias`: the required identity of its drive, as shown by a scan; a drive that differs
    from these or from the drive first opened is reported and nothing is switched on.

    `terminals` are input and output terminals, digital or analog, as well as encoders and sensors, each with `at`: `{"io": {"at": 2,
    "channels": {"door": "Channel 3", "force": {"entry": "AI Standard Channel 1.Value", "scale": 0.01, "unit": "N"}}}}`. A channel is
    an entry of their process data, specified by the vendor's name or by its index, `0x6000:1`; without `channels` all entries are
    channels, named in lower case with underscores. With `scale` or `offset` a channel is a double, counts × scale + offset, in
    `unit`; otherwise it has the type of its entry. `safe`: the value of an output while it is not commanded (off, or 0 counts). Names
    come from the terminal's EEPROM, which is read when the device is created, or with `esi` from the vendor's XML file, in which
    `type` (`"EL1008"`), `product` and `revision` select the terminal. `vendor`, `product`, `revision`, `serial`, `alias` are compared
    as for an axis. `device["io.door"]` is a channel.

    Channels of an axis: `position`, `velocity`, `torque`, `status`, `error`, `homing`, `operating` (read), and `goal`, `rate` or
    `effort` (written), depending on its mode. `enable` and verbs wait for `operating`. An axis is switched on through the CiA 402
    state machine when its written channel is engaged, and never jumps: its target starts at its actual position and changes no faster
    than `speed_max`. `timeout` (100 ms) is the watchdog of the drives. The device is lost after `lost_after` (3) cycles without an
    answer. `sync0`, the period of the source, synchronises the distributed clocks of the drives to the time of this host and makes
    them accept their targets with SYNC0, `sync0_shift` (half of it) after each release. `interface` is a network interface, which
    needs CAP_NET_RAW, or the interface of an emulated segment, `gpac.drivers.fake.ethercat`.
    """
    for name, axis in axes.items():
        if not isinstance(axis, Mapping):
            refuse(CallError, f"axis '{name}' must be a dictionary, not {axis!r}", "write {'counts': 10000}, for example")
    for name, terminal in (terminals or {}).items():
        if not isinstance(terminal, Mapping):
            refuse(CallError, f"terminal '{name}' must be a dictionary, not {terminal!r}", "write {'at': 2}, for example")
    return Driver(
        "ethercat",
        given(
            interface=interface,
            axes=[{"name": name, **axis} for name, axis in axes.items()],
            terminals=[_terminal(name, terminal) for name, terminal in (terminals or {}).items()],
            timeout_ns=optional_ns(timeout, "the timeout"),
            lost_after=lost_after,
            sync0_ns=optional_ns(sync0, "sync0"),
            sync0_shift_ns=optional_ns(sync0_shift, "the shift of sync0"),
        ),
    )


def _terminal(name: str, terminal: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the options of a terminal in the driver's format. A channel given as text becomes the entry of that name, and an ESI file
    supplies the process data."""
    told = {"name": name, **terminal}
    if (channels := told.get("channels")) is not None:
        if not isinstance(channels, Mapping):
            refuse(
                CallError,
                f"the channels of terminal '{name}' must be a dictionary, not {channels!r}",
                'write {"door": "Channel 3"}, for example',
            )
        told["channels"] = {own: {"entry": of} if isinstance(of, str) else of for own, of in channels.items()}
    file, type_ = told.pop("esi", None), told.pop("type", None)
    if file is None:
        if type_ is not None:
            refuse(CallError, f"terminal '{name}' has type={type_!r} but no esi= that describes it", "pass esi=, or omit type=")
        return told
    product, revision = told.get("product"), told.get("revision")
    found = esi.described(file, type=type_, product=product, revision=revision, what=f"terminal '{name}'")
    return {**{key: value for key, value in found.items() if value is not None}, **told}
