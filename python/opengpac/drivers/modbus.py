# SPDX-License-Identifier: Apache-2.0
"""Modbus devices, over TCP and serial lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import CallError, refuse
from ..refusals.argument_types import taking
from ..values.quantities import Quantity, optional_ns
from .driver import Driver, given


@taking
def modbus(
    address: str,
    *,
    channels: Mapping[str, Mapping[str, Any]],
    unit: int | None = None,
    period: Quantity | None = None,
    answer: Quantity | None = None,
    retries: int | None = None,
    gap: int | None = None,
    age_max: Quantity | None = None,
) -> Driver:
    """A Modbus device: `modbus("tcp/192.0.2.5:502", channels={"pressure": {"input": 0, "scale": 0.01, "unit": "bar"}})`.

    `address` is `tcp/HOST:PORT` (port 502 by default) or `rtu//dev/ttyUSB0?baud=19200&parity=even&stop=1`. Units on one serial line
    are separate devices, which take turns on the line; `unit` is the number of the unit.

    A channel belongs to a table of the device: `{"holding": 10}`, `"input"`, `"coil"` or `"discrete"`; the first address is 0. A
    register is a number of `"type"` (`"uint16"`; `int16`, `int32`, `uint32`, `int64`, `uint64`, `float`, `double`) with the byte
    `"order"` (`"ABCD"`; `"CDAB"`, `"BADC"`, `"DCBA"`), and becomes a double, `"scale"` times its value plus `"offset"`, in `"unit"`;
    with `"raw": True` it keeps its type; `"bit": 3` selects one bit of it, `"byte": "low"` or `"high"` one byte. `"write": True`
    declares a channel that is written when its value changes, `"write": "each"` a channel that is written in each period; `"safe"` is
    its value while it is not commanded (0, False). `"every": "1 s"` polls a channel less often.

    The device is exchanged each `period` (10 ms) on a separate thread, and has the channel `age`, in seconds. An `answer` may take
    0.5 s; a request is repeated up to `retries` times (2), then the device is lost, as it is if its readings are older than `age_max`
    (2 s). Neighbouring registers are read by one request, with at most `gap` (0) unused registers between them.
    """
    return Driver(
        "modbus",
        given(
            address=address,
            channels=channels_of(channels),
            unit=unit,
            period_ns=optional_ns(period, "the period"),
            answer_ns=optional_ns(answer, "the timeout of an answer"),
            retries=retries,
            gap=gap,
            age_max_ns=optional_ns(age_max, "the maximum age"),
        ),
    )


def channels_of(channels: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the channels in the driver's format, with durations in nanoseconds. The driver itself checks the rest."""
    made = {}
    for name, channel in channels.items():
        if not isinstance(channel, Mapping):
            refuse(CallError, f"channel '{name}' must be a dictionary, not {channel!r}", 'write {"input": 0, "unit": "bar"}, for example')
        words = dict(channel)
        if "every" in words:
            words["every_ns"] = optional_ns(words.pop("every"), f"the interval of '{name}'")
        made[str(name)] = words
    return made


@taking
def modbus_server(
    address: str,
    *,
    channels: Mapping[str, Mapping[str, Any]],
    to_network: bool | None = None,
    clients: int | None = None,
    silent: Quantity | None = None,
    period: Quantity | None = None,
    age_max: Quantity | None = None,
) -> Driver:
    """Server that exposes signals of this machine to Modbus TCP clients, such as a line controller: `modbus_server("tcp/127.0.0.1:1502",
    …)`.

    `channels` are declared as for `modbus`; `address` is the server's address. Channels that are read here contain values written by
    clients, in `holding` registers and coils; clients read the channels that are written here (`"write": True`), in any table. Other
    addresses are refused. A request is executed completely or not at all.

    Modbus has no authentication: every program that can reach the port may write. Therefore the server listens only on this host
    (127.0.0.1), or with `to_network=True` at any address; a network of machines needs a firewall. Up to `clients` (8) may be
    connected; a further connection replaces the one that has been idle longest. With `silent="2 s"` the device is lost if clients,
    after their first request, send none for that time. Registers and channels are exchanged once per `period` (10 ms).
    """
    return Driver(
        "modbus_server",
        given(
            address=address,
            channels=channels_of(channels),
            to_network=to_network,
            clients=clients,
            silent_ns=optional_ns(silent, "the timeout of clients"),
            period_ns=optional_ns(period, "the period"),
            age_max_ns=optional_ns(age_max, "the maximum age"),
        ),
    )
