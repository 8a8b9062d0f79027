# SPDX-License-Identifier: Apache-2.0
"""Digital and analog inputs and outputs as logical devices. A verb keeps each signal up to date, so that any number of verbs can read
it."""

from __future__ import annotations

from typing import Any

from .. import library as lib
from ..definition.commands import activate, execute, ready
from ..definition.verbs import Verb
from ..devices.logical import LogicalDevice, parameter, svv
from ..devices.physical import Channel
from ..errors import CallError, refuse
from ..system.sources import Source
from ..system.svvs import SVV

EXCHANGE = "1 ms"
"""Interval at which a signal is read or written if its source does not define one."""


def _input(name: str, block: str) -> Verb[..., Any]:
    return Verb(
        name,
        doc="Updates an input: value = channel, at every firing of its source.",
        blocks={"read": lib.block(block)},
        instantiation_parameters={"channel": "read.channel", "value": "read.y"},
        command_lists={"start": [execute("read"), activate("read", every=EXCHANGE), ready()]},
    )


def _output(name: str, block: str, **inputs: str) -> Verb[..., Any]:
    return Verb(
        name,
        doc="Updates an output: channel = commanded, at every firing of its source, from at_enable on.",
        blocks={"write": lib.block(block)},
        instantiation_parameters={"channel": "write.channel", "commanded": "write.u", "value": "write.y"},
        input_parameters={"at_enable": "write.u", **inputs},
        command_lists={"start": [execute("write"), activate("write", every=EXCHANGE), ready()]},
    )


class _Signal(LogicalDevice):
    """Signal of one channel, exchanged by default at the rate of its physical device."""

    _type = "bool"
    _written = False

    def __init__(self, name: str, channel: Channel, *, on: Source | None = None, **parameters: Any) -> None:
        kind = type(self).__name__
        if not isinstance(channel, Channel):
            refuse(
                CallError,
                f"{kind} '{name}' must be bound to a channel of a physical device, not {channel!r}",
                "pass io['gate'], for example",
            )
        if channel.type != self._type or channel.write != self._written:
            way, wanted = "written" if channel.write else "read", "written" if self._written else "read"
            says = f"channel '{channel.device.name}.{channel.name}' ({channel.type}) is {way}"
            refuse(CallError, f"{kind} '{name}' cannot be created: {says}", f"pass a channel of type {self._type} that is {wanted}")
        if not (on is None or isinstance(on, Source)):
            refuse(CallError, f"on= of {kind} '{name}' must be an interrupt source, not {on!r}", "pass an interrupt source, or omit on=")
        source = channel.device.source if on is None else on
        every = {"write" if self._written else "read": source.period} if source.period else None
        self._channel = channel
        super().__init__(name, on=source, every=every, channel=channel, **parameters)

    @property
    def channel(self) -> Channel:
        """Channel of the physical device."""
        return self._channel


class DigitalInput(_Signal, verb=_input("digital_input", "read_digital"), name="digital_input"):
    """A digital input: `gpac.cell.DigitalInput("gate", io["gate"])`."""

    value: SVV[bool] = svv(reading=True)


class AnalogInput(_Signal, verb=_input("analog_input", "read_channel"), name="analog_input"):
    """An analog input, in the unit of its channel: `gpac.cell.AnalogInput("pressure", io["pressure"])`."""

    _type = "double"
    value: SVV[float] = svv(reading=True)


class DigitalOutput(_Signal, verb=_output("digital_output", "write_digital"), name="digital_output"):
    """A digital output. It takes the value `at_enable` when it is enabled, and the channel's safe value when it is disabled.

    `commanded` is the set-point: set by `set_output`, or by Python while no verb claims it. `value` is the value most recently
    written.
    """

    _written = True
    commanded: SVV[bool] = svv()
    value: SVV[bool] = svv()
    at_enable: bool = parameter(False)


class AnalogOutput(_Signal, verb=_output("analog_output", "write_analog", low="write.low", high="write.high"), name="analog_output"):
    """An analog output, in the unit of its channel, limited to `low` … `high`; otherwise like a digital output."""

    _type, _written = "double", True
    commanded: SVV[float] = svv()
    value: SVV[float] = svv()
    at_enable: float = parameter(0.0)
    low: float = parameter(-1e300, within=(-1e300, "high"))
    high: float = parameter(1e300, within=("low", 1e300))
