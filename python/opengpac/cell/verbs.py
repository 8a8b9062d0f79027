# SPDX-License-Identifier: Apache-2.0
"""Verbs that set an output, pulse it, or wait for an input. Each exists for digital and for analog signals, in the three invocation
modes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

from .. import library as lib
from ..application.instances import VerbInstance
from ..application.reports import Report
from ..definition.commands import activate, execute
from ..definition.conditions import on
from ..definition.parameters import input
from ..definition.verbs import Verb
from ..devices.physical import Channel
from ..errors import CallError, Terminated, did_you_mean, refuse
from ..system.sources import Source
from ..system.svvs import SVV
from ..values.quantities import Quantity
from .signals import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput

R = TypeVar("R", bound=Report, covariant=True)


class InputTimeout(Terminated):
    """Raised if an input did not reach the awaited value within the time limit."""


def _set(kind: type[Any], name: str, block: str, there: str, **targets: list[str]) -> Verb[..., Any]:
    return Verb(
        name,
        doc="Sets an output and returns when that has been written to the machine.",
        blocks={"set": lib.block(block), "there": lib.block(there)},
        objects={"output": kind},
        instantiation_parameters={"output.commanded": "set.y", "output.value": "there.u"},
        input_parameters=targets,
        command_lists={"start": [execute("set"), activate("there")]},
        conditions={"written": on("there.done", returns=[])},
        manual=True,
    )


_set_digital = _set(DigitalOutput, "set_digital_output", "set_digital", "await_digital", value=["set.value", "there.value"])
_set_analog = _set(
    AnalogOutput, "set_analog_output", "set_analog", "await_range",
    value=["set.value", "there.low", "there.high"], **{"output.low": ["set.low"], "output.high": ["set.high"]},
)  # fmt: skip

_DIGITAL = {"value": input("watch.value", default=True), "edge": input("watch.edge", default=False)}
_RANGE = {"above": input("watch.low", default=-1e300), "below": input("watch.high", default=1e300)}


def _wait(kind: type[Any], name: str, block: str, inputs: Mapping[str, Any]) -> Verb[..., Any]:
    return Verb(
        name,
        doc="Waits for an input; every reading of its device is checked.",
        blocks={"watch": lib.block(block)},
        objects={"source": kind},
        instantiation_parameters={"source.value": "watch.u"},
        input_parameters=inputs,
        output_values={"reading": "watch.latest"},
        command_lists={"start": [activate("watch")]},
        conditions={"came": on("watch.done", returns=["reading"]), "time_limit": on(raises=InputTimeout)},
        manual=True,
    )


def _wait_for_channel(name: str, read: str, block: str, inputs: Mapping[str, Any]) -> Verb[..., Any]:
    return Verb(
        name,
        doc="Waits for a channel of a physical device.",
        blocks={"read": lib.block(read), "watch": lib.block(block)},
        instantiation_parameters={"channel": "read.channel"},
        cells={"reading": ["read.y", "watch.u"]},
        input_parameters=inputs,
        output_values={"reading": "watch.latest"},
        command_lists={"start": [activate("read", every="1 ms"), activate("watch")]},
        conditions={"came": on("watch.done", returns=["reading"]), "time_limit": on(raises=InputTimeout)},
        manual=True,
    )


_LOOK = 0.01
"""Polling interval for an SVV that another verb writes, in s; rounded up to a multiple of the timer's period."""


def _looked_at(verb: Verb[..., Any] | None, timers: Sequence[Source]) -> Verb[..., Any] | None:
    """Returns `verb` with a polling interval that one of these timers can serve."""
    periods = [timer.period for timer in timers]
    if verb is None or not periods or any(_divides(period, _LOOK) for period in periods):
        return verb
    fastest = min(periods)
    return verb.on(every={"watch": math.ceil(_LOOK / fastest - 1e-9) * fastest})


def _divides(period: float, interval: float) -> bool:
    return abs(interval / period - round(interval / period)) < 1e-9 <= round(interval / period)


def _wait_for_value(name: str, block: str, inputs: Mapping[str, Any]) -> Verb[..., Any]:
    return Verb(
        name,
        doc="Waits for an SVV, whatever writes it; it is checked every 10 ms, or as often as its timer allows.",
        blocks={"watch": lib.block(block)},
        instantiation_parameters={"svv": "watch.u"},
        modes={"watch.u": "asynchronous"},
        input_parameters=inputs,
        output_values={"reading": "watch.latest"},
        command_lists={"start": [activate("watch", every="10 ms")]},
        conditions={"came": on("watch.done", returns=["reading"]), "time_limit": on(raises=InputTimeout)},
        manual=True,
    )


_wait_digital = _wait(DigitalInput, "wait_for_digital_input", "await_digital", _DIGITAL)
_wait_analog = _wait(AnalogInput, "wait_for_analog_input", "await_range", _RANGE)
_channel_digital = _wait_for_channel("wait_for_digital_channel", "read_digital", "await_digital", _DIGITAL)
_channel_analog = _wait_for_channel("wait_for_analog_channel", "read_channel", "await_range", _RANGE)
_value_digital = _wait_for_value("wait_for_digital_value", "await_digital", _DIGITAL)
_value_analog = _wait_for_value("wait_for_analog_value", "await_range", _RANGE)

_pulse = Verb(
    "pulse_output",
    doc="Sets a digital output for a time; a pulse that is cut short also ends with the output off.",
    blocks={"pulse": lib.block("pulse_digital"), "clear": lib.block("pulse_digital")(width=0.0)},
    objects={"output": DigitalOutput},
    instantiation_parameters={"output.commanded": ["pulse.y", "clear.y"], "output.value": ["pulse.written", "clear.written"]},
    input_parameters={"width": "pulse.width"},
    command_lists={"start": [activate("pulse")], "off": [activate("clear")]},
    initial="start",
    conditions={"over": on("pulse.done", returns=[], during="start"), "cut_short": on("clear.done", returns=[], during="off")},
    transitions={("start", cut): "off" for cut in ("halted", "aborted", "time_limit")},
    manual=True,
)


class SignalVerb(Generic[R]):
    """Verb selected by the kind of its signal. Has the three invocation modes of every verb."""

    def __init__(self, name: str, doc: str, choose: Callable[[Any], Verb[..., R] | None], wants: str) -> None:
        self.__name__ = self.name = name
        self.__doc__ = doc
        self._choose, self._wants = choose, wants

    def verb(self, signal: Any) -> Verb[..., R]:
        """Returns the verb for this signal, or for a kind of signal (`DigitalInput`), for use in a composition; the verb of a channel is
        placed on the source that exchanges it."""
        chosen = self._choose(signal)
        if chosen is None:
            refuse(CallError, f"{self.name}() cannot act on {signal!r}", self._wants)
        return chosen

    def on(self, where: Any = None, *, every: Mapping[str, Quantity] | None = None) -> SignalVerb[R]:
        """Returns this verb with a placement, like `Verb.on`."""

        def choose(signal: Any) -> Verb[..., R] | None:
            chosen = self._choose(signal)
            if chosen is not None and isinstance(signal, SVV) and isinstance(where, Source) and where.kind == "timer":
                chosen = _looked_at(chosen, [where])
            return chosen and chosen.on(where, every=every)

        return SignalVerb(self.name, self.__doc__ or "", choose, self._wants)

    def __call__(self, signal: Any, /, *args: Any, **kwargs: Any) -> R:
        """Runs the verb and returns its report."""
        return self.verb(signal)(signal, *args, **_edges(kwargs))

    def asynch(self, signal: Any, /, *args: Any, **kwargs: Any) -> VerbInstance[R]:
        """Starts the verb, and returns an instance whose `wait()` waits for the end and deletes it."""
        return self.verb(signal).asynch(signal, *args, **_edges(kwargs))

    def new_instance(self, signal: Any, /) -> VerbInstance[R]:
        """Creates an instance that can be started any number of times."""
        return self.verb(signal).new_instance(signal)

    def __repr__(self) -> str:
        return f"verb {self.name}: {self.__doc__}"


_EDGES = {"rising": True, "falling": False}


def _edges(kwargs: dict[str, Any]) -> dict[str, Any]:
    """Translates `edge="rising"` into the verb's arguments: the value to which the signal must change."""
    edge = kwargs.get("edge")
    if not isinstance(edge, str):
        return kwargs
    if edge not in _EDGES or "value" in kwargs:
        remedy = did_you_mean(edge, _EDGES) if edge not in _EDGES else "write edge='rising' without value=, or value=True, edge=True"
        refuse(CallError, f"edge= of wait_for_input() cannot be {edge!r}", remedy)
    return {**kwargs, "value": _EDGES[edge], "edge": True}


def _by_type(signal: Any, verbs: Mapping[type, Verb[..., Any]]) -> Verb[..., Any] | None:
    return next((verb for kind, verb in verbs.items() if isinstance(signal, kind) or signal is kind), None)


def _waiting(signal: Any) -> Verb[..., Any] | None:
    if isinstance(signal, Channel) and not signal.write:
        verb = {"bool": _channel_digital, "double": _channel_analog}.get(signal.type)
        source = signal.device.source
        return verb and verb.on(source, every={"read": source.period})
    if isinstance(signal, SVV):
        timers = [source for source in signal.system.sources.values() if source.kind == "timer"]
        return _looked_at({"bool": _value_digital, "double": _value_analog}.get(signal.type), timers)
    return _by_type(signal, {DigitalInput: _wait_digital, AnalogInput: _wait_analog})


_MAKE_OUTPUT = "pass a logical device that drives the output: gpac.cell.DigitalOutput('valve', io['valve'])"

set_output: SignalVerb[Report] = SignalVerb(
    "set_output",
    "Sets a digital or analog output, `set_output(valve, True)`, and returns when it has been written to the machine.",
    lambda signal: _by_type(signal, {DigitalOutput: _set_digital, AnalogOutput: _set_analog}),
    _MAKE_OUTPUT,
)

pulse: SignalVerb[Report] = SignalVerb(
    "pulse",
    "Sets a digital output for a time, `pulse(valve, width='0.2 s')`; suspended time does not count.",
    lambda signal: _by_type(signal, {DigitalOutput: _pulse}),
    _MAKE_OUTPUT,
)

wait_for_input: SignalVerb[Report] = SignalVerb(
    "wait_for_input",
    "Waits for an input or a channel: `wait_for_input(gate, True, time_limit='5 s')`, `edge='rising'`, analog `above=4.0`, `below=6.0`.",
    _waiting,
    "pass a digital or analog input, an SVV, or a channel of type bool or double that is read",
)
