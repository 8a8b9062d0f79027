# SPDX-License-Identifier: Apache-2.0
"""Drivers in Python: a class with options and channels, whose `exchange` runs in a process of its own.

    from opengpac.driver import Driver, Option, read, write

    class Thermometer(Driver):
        "A thermometer with a heater, on a serial line."

        port: str = Option("the serial port")
        temperature = read("double", unit="K")
        heater = write("double", unit="W", safe=0.0)
        damaged = counter("answers with a wrong check sum")

        def open(self): ...
        def exchange(self): ...
        def safe_state(self): ...
        def close(self): ...

        @classmethod
        def scan(cls, **options): ...

        @service
        def calibrate(self, at: float = Option("the temperature that it has", unit="K")) -> None:
            "Takes the present temperature for this one."

`gpac.drivers.python("thermometer.py", port="/dev/ttyS0", period="10 ms")` is what `rtp.physical_device` takes. The source that exchanges
with the device never waits for the process: it takes the newest readings, whose age is the channel `age`.
"""

from __future__ import annotations

import functools
import inspect
import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar, overload

from .. import _native
from ..errors import CallError, DefinitionError, DeviceFailed, did_you_mean, refusals, refuse
from ..values.numbers import number, range_of

__all__ = [
    "NOTHING_NEW", "Channel", "Counter", "Driver", "NothingNew", "Option", "Part", "PartValues", "Service", "counter", "part", "read",
    "service", "write",
]  # fmt: skip

F = TypeVar("F", bound=Callable[..., Any])

_FORMATS = {
    "bool": "?", "int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I", "int64_t": "q",
    "uint64_t": "Q", "float": "f", "double": "d",
}  # fmt: skip
_NEEDED: Any = object()
_UNLIMITED = 1e6
"""What stands for no limit of a part, as in drivers of other languages."""


class NothingNew:
    """Type of `NOTHING_NEW`."""

    def __repr__(self) -> str:
        return "NOTHING_NEW"


NOTHING_NEW: Final = NothingNew()
"""What `exchange` returns where the machine has told nothing since the last one: its readings are those from before."""

_KINDS: dict[str, type] = {"str": str, "int": int, "float": float, "bool": bool, "list": list, "dict": dict}
_KIND_NAMES: dict[type | None, str] = {str: "text", int: "whole", float: "number", bool: "bool", list: "list", dict: "table"}
"""As declarations of drivers name them."""


class _Named:
    """Member that a class declares: it has the name that the class gives it."""

    name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name


class _Option(_Named):
    def __init__(self, doc: str, default: Any, unit: str, within: str | Sequence[float] | None = None) -> None:
        self.doc, self.default, self.unit = doc, default, unit
        ends = range_of(within, "the range of an option")
        text = ends if isinstance(ends, str | None) else f"[{ends[0]}, {ends[1]}]"
        # A time without a declared range is not negative.
        self.range = text or ("[0, inf)" if unit in ("s", "ns") else None)

    def taken(self, kind: type | None, value: Any, what: str) -> Any:
        """The value of the option, of the type that its annotation says; a text with a unit where a number in that unit is asked for."""
        if isinstance(value, str) and kind in (int, float) and self.unit:
            with refusals:
                value = kind(_native.number_in(value, self.unit))
        value = number(value)
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        if kind is not None and (not isinstance(value, kind) or (kind is int and isinstance(value, bool))):
            unit = f" in {self.unit}" if self.unit else ""
            refuse(CallError, f"{what} is {value!r}", f"give {kind.__name__}{unit}: {self.doc}")
        if kind in (int, float):
            with refusals:
                _native.check_range(what, f"{self.unit} {self.range or ''}".strip(), float(value))
        return value

    def about(self, name: str, kind: type | None) -> dict[str, Any]:
        """Returns the option as manuals have it."""
        default = None if self.default is _NEEDED else str(self.default)
        ranged = {} if self.range is None or kind not in (int, float) else {"range": self.range}
        return {"name": name, "kind": _KIND_NAMES.get(kind, "text"), "unit": self.unit, **ranged, "default": default, "doc": self.doc}


def _annotated(owner: type, name: str) -> type | None:
    for kind in owner.__mro__:
        given = inspect.get_annotations(kind).get(name)
        if given is not None:
            return _kind(given)
    return None


def _kind(given: Any) -> type | None:
    return given if isinstance(given, type) else _KINDS.get(str(given).partition("[")[0])


class Channel(_Named):
    """A channel of a driver; made by `read` and `write`. On the object it is its value."""

    def __init__(self, type: str, unit: str, doc: str, write: bool, safe: Any, slew: float | None) -> None:
        number, _, count = type.partition("[")
        if number not in _FORMATS or (count and not count[:-1].isdecimal()):
            refuse(DefinitionError, f"a channel of type '{type}'", did_you_mean(number, _FORMATS))
        self.type, self.unit, self.doc, self.write, self.slew = type, unit, doc, write, slew
        self.elements = int(count[:-1]) if count else None
        self.format = struct.Struct(f"={self.elements or 1}{_FORMATS[number]}")
        zero: Any = False if number == "bool" else 0.0 if number in ("float", "double") else 0
        self.initial = (zero if self.elements is None else [zero] * self.elements) if safe is None else safe

    def pack(self, value: Any) -> bytes:
        """The bytes of a value. Refused: it does not fit the type."""
        try:
            return self.format.pack(*(value if self.elements is not None else (value,)))
        except (struct.error, TypeError) as why:
            raise TypeError(f"channel '{self.name}' ({self.type}) is given {value!r}: {why}") from None

    def unpack(self, group: bytes, offset: int) -> Any:
        """The value whose bytes lie there."""
        values = self.format.unpack_from(group, offset)
        return values[0] if self.elements is None else list(values)


class Part(_Named):
    """A joint of the machine; made by `part`. On the object it is its `PartValues`."""

    def __init__(self, unit: str, command: str, operating: bool, limits: Mapping[str, Any]) -> None:
        self.unit, self.command, self.limits = unit, command, limits
        force = "N.m" if unit == "rad" else "N"
        self.channels = {
            "position": Channel("double", unit, "where it is", False, None, None),
            "velocity": Channel("double", f"{unit}/s", "how fast it moves", False, None, None),
        }
        if command == "position":
            self.channels["goal"] = Channel("double", unit, "where it is to be; NaN: it stays", True, math.nan, None)
        else:
            self.channels["bias"] = Channel("double", force, "the effort that holds it", False, None, None)
            self.channels["effort"] = Channel("double", force, "what moves it", True, None, None)
        if operating:
            self.channels["operating"] = Channel("bool", "", "whether it follows what it is told", False, None, None)

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        for word, channel in self.channels.items():
            channel.name = f"{name}.{word}"

    def about(self) -> dict[str, Any]:
        """Returns the part as devices have it."""
        return {"name": self.name, "unit": self.unit, "command": self.command, **self.limits}


class PartValues:
    """Values of a joint: `position`, `velocity`, and `goal` or `bias` and `effort`, as its `part` declares.

    `engaged` says whether a verb commands it; the motor of a joint that is not is to be off, or to hold.
    """

    def __init__(self, part: Part) -> None:
        self.__dict__["engaged"] = False
        self.__dict__.update({word: channel.initial for word, channel in part.channels.items()})

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.__dict__:
            raise AttributeError(f"a part has no channel '{name}'; {did_you_mean(name, self.__dict__)}")
        self.__dict__[name] = value

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"a part has no channel '{name}'; {did_you_mean(name, self.__dict__)}")


class Counter(_Named):
    """Counter of a driver; made by `counter`. On the object it is the number so far."""

    def __init__(self, doc: str, unit: str) -> None:
        self.doc, self.unit = doc, unit

    def about(self) -> dict[str, Any]:
        """Returns the counter as manuals have it."""
        return {"name": self.name, "unit": self.unit, "doc": self.doc}


class Service:
    """A service of a driver; made by `service` of a method. Its arguments are those of the method, `Option`s or with plain defaults."""

    def __init__(self, method: Callable[..., Any], moves: bool) -> None:
        self.name = method.__name__
        self.moves = moves
        self.doc = (inspect.getdoc(method) or "").partition("\n")[0].rstrip(".")
        signature = inspect.signature(method)
        self.arguments = {name: (_argument(name, p), _kind(p.annotation)) for name, p in [*signature.parameters.items()][1:]}
        for name, (_, kind) in self.arguments.items():
            if kind not in _KIND_NAMES:
                kinds = ", ".join(_KINDS)
                refuse(DefinitionError, f"argument '{name}' of service '{self.name}' has no type that can be sent", f"annotate it: {kinds}")
        given = signature.return_annotation
        self.answer = None if given in (None, "None", inspect.Signature.empty) else _kind(given)
        if self.answer not in _KIND_NAMES and self.answer is not None:
            refuse(DefinitionError, f"service '{self.name}' answers {given}, which cannot be sent", f"answer None, {', '.join(_KINDS)}")
        if not self.doc:
            refuse(DefinitionError, f"service '{self.name}' has no docstring", "say in one line what it does")

    def taken(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """The arguments of the method. Refused: one is missing, unknown or of another type."""
        for wrong in given.keys() - self.arguments.keys():
            refuse(CallError, f"service '{self.name}' has no argument '{wrong}'", did_you_mean(wrong, self.arguments))
        found: dict[str, Any] = {}
        for name, (option, kind) in self.arguments.items():
            if name not in given and option.default is _NEEDED:
                refuse(CallError, f"service '{self.name}' needs argument '{name}'", f"give {name}: {option.doc}")
            what = f"argument '{name}' of service '{self.name}'"
            found[name] = option.taken(kind, given[name], what) if name in given else option.default
        return found

    def about(self) -> dict[str, Any]:
        """Returns the service as manuals have it."""
        arguments = [option.about(name, kind) for name, (option, kind) in self.arguments.items()]
        answer = _KIND_NAMES[self.answer] if self.answer else None
        return {"name": self.name, "doc": self.doc, "arguments": arguments, "answer": answer, "moves": self.moves}


def _argument(name: str, parameter: inspect.Parameter) -> _Option:
    if isinstance(parameter.default, _Option):
        return parameter.default
    return _Option(name, _NEEDED if parameter.default is inspect.Parameter.empty else parameter.default, "")


def Option(doc: str, default: Any = _NEEDED, *, unit: str = "", within: str | Sequence[float] | None = None) -> Any:
    """An option of a driver: `port: str = Option("the serial port")`. Without a default it must be given; a number may have a unit.

    `within` is the range of a number, `(0, 60)` or `"(0, inf)"`: what is out of it is refused before the device is opened. A time (`s`,
    `ns`) without one is not negative.
    """
    return _Option(doc, default, unit, within)


def read(type: str = "double", *, unit: str = "", doc: str = "") -> Any:
    """A channel that is read from the machine: `exchange` sets it. `type`: a number of C, or an array, `"double[3]"`."""
    return Channel(type, unit, doc, False, None, None)


def write(type: str = "double", *, unit: str = "", doc: str = "", safe: Any = None, slew: float | None = None) -> Any:
    """A channel that is written to the machine: `exchange` finds the command in it. `safe` is what it carries while no verb commands
    it (0 where nothing is said), `slew` the fastest change of a `double`, in units per second."""
    return Channel(type, unit, doc, True, safe, slew)


def part(
    *,
    unit: str = "rad",
    command: str = "position",
    range: tuple[float | str, float | str] | None = None,
    speed_max: float | str | None = None,
    effort_max: float | str | None = None,
    home: float | str = 0.0,
    kp: float = 0.0,
    kd: float = 0.0,
    operating: bool = False,
) -> Any:
    """A joint of the machine, `elbow = part(range=("-150 deg", "150 deg"), speed_max=2.0)`: `exchange` sets `self.elbow.position` and
    `self.elbow.velocity`, and finds `self.elbow.goal`, NaN for no goal. `gpac.robots.Joint(…, drive=device["elbow"])` moves it.

    `unit`: `rad` or `m`. `command="effort"` is a joint whose loop is closed by the program, with gains `kp` and `kd` at 1 kHz: it finds
    `effort`, and sets `bias`, the effort that holds it. `operating=True`: `exchange` sets `self.elbow.operating`, and `enable` and verbs
    wait until it is true. Limits that are left out are none; numbers are in `unit`, texts in any unit.
    """
    if unit not in ("rad", "m") or command not in ("position", "effort"):
        refuse(DefinitionError, f"a part in '{unit}' with command '{command}'", "unit is 'rad' or 'm', command 'position' or 'effort'")

    def number(value: float | str | None, of: str, without: float) -> float:
        if isinstance(value, str):
            with refusals:
                return _native.number_in(value, of)
        return without if value is None else float(value)

    force = "N.m" if unit == "rad" else "N"
    lower, upper = (number(None if range is None else range[end], unit, none) for end, none in ((0, -_UNLIMITED), (1, _UNLIMITED)))
    limits = {
        "range_min": lower, "range_max": upper, "home": number(home, unit, 0.0), "servo": {"kp": float(kp), "kd": float(kd)},
        "speed_max": number(speed_max, f"{unit}/s", _UNLIMITED), "effort_max": number(effort_max, force, _UNLIMITED),
    }  # fmt: skip
    if not (lower < upper and limits["speed_max"] > 0 and limits["effort_max"] > 0):
        refuse(DefinitionError, f"a part with the limits {limits}", "give a range that rises, and maxima above 0")
    return Part(unit, command, operating, limits)


def counter(doc: str, *, unit: str = "") -> Any:
    """Declares a counter of a driver, `damaged = counter("answers with a wrong check sum")`: 0 at first, and `exchange` adds to it.
    Programs find it in `device.counters`, `statistics` and `opengpac top`."""
    return Counter(doc, unit)


@overload
def service(method: F) -> F: ...
@overload
def service(*, moves: bool = False) -> Callable[[F], F]: ...
def service(method: F | None = None, *, moves: bool = False) -> F | Callable[[F], F]:
    """Makes a method what programs call off the cycle, `device.services.calibrate(at="300 K")`: its types are checked, its docstring is
    shown. An argument may be an `Option` with unit and text. It runs between two exchanges: while it lasts, readings get older.
    `@service(moves=True)` says that it moves the machine: it is refused while an emergency stop is latched."""

    def made_of(method: F) -> F:
        made = Service(method, moves)

        @functools.wraps(method)
        def call(self: Driver, *values: Any, **named: Any) -> Any:
            return method(self, **made.taken({**dict(zip(made.arguments, values, strict=False)), **named}))

        call.service = made  # type: ignore[attr-defined]
        return call  # type: ignore[return-value]

    return made_of if method is None else made_of(method)


class Driver:
    """Base of drivers in Python. One object stands for one open device; all its methods are called by one thread.

    What a method raises is `device_lost` with the exception's text, or why the device cannot be opened. A device that was lost comes
    back with `reopen()` or `reset()`, which make a new object in a new process.
    """

    def __init__(self, **options: Any) -> None:
        declared = self.members(_Option)
        for wrong in options.keys() - declared.keys():
            refuse(CallError, f"driver {type(self).__name__} has no option '{wrong}'", did_you_mean(wrong, declared))
        for name, option in declared.items():
            given = options.get(name, option.default)
            if given is _NEEDED:
                refuse(CallError, f"driver {type(self).__name__} needs option '{name}'", f"give {name}: {option.doc}")
            what = f"option '{name}' of driver {type(self).__name__}"
            self.__dict__[name] = option.taken(_annotated(type(self), name), given, what) if name in options else given
        for name, channel in self.members(Channel).items():
            self.__dict__[name] = channel.initial
        for name, declared_part in self.members(Part).items():
            self.__dict__[name] = PartValues(declared_part)
        for name in self.members(Counter):
            self.__dict__[name] = 0

    @classmethod
    def members(cls, kind: type[Any]) -> Mapping[str, Any]:
        """Returns the members of that kind that the class and its bases declare, by name."""
        return {n: m for base in reversed(cls.__mro__) for n, m in vars(base).items() if isinstance(m, kind)}

    @classmethod
    def scan(cls, **options: Any) -> Sequence[Mapping[str, Any]]:
        """Looks for devices that the class could open; nothing moves. `options` are those of the class, checked, that say where to look.

        Returns what is found, `{"what": "a thermometer, number 4711", "options": {"port": "/dev/ttyS0"}}` each. Most buses can be asked;
        a class that cannot look leaves it as it is.
        """
        raise NotImplementedError(f"{cls.__name__} has no scan()")

    def open(self) -> None:
        """Opens the device; called once. What it raises is why it cannot be opened."""

    def exchange(self) -> float | NothingNew | None:
        """Exchanges values with the machine, once a period: channels that are written hold commands, those that are read are to be set.

        Returns nothing where the readings are of now, how old they are, s, where the machine tells, and `NOTHING_NEW` where it has told
        nothing: the readings stay those from before, and the channel `age` goes on growing.
        """
        raise NotImplementedError(f"{type(self).__name__} has no exchange()")

    def safe_state(self) -> None:
        """Brings the outputs to their safe state: where the program is gone or commands no more, after a failure, and before `close`."""

    def close(self) -> None:
        """Closes the device; called once, also after a failure."""


def channels_of(kind: type[Driver]) -> dict[str, Channel]:
    """The channels of a class by name, those of its parts too, in the order in which they are declared."""
    found: dict[str, Channel] = {}
    for name, member in kind.members(_Named).items():
        if isinstance(member, Channel):
            found[name] = member
        elif isinstance(member, Part):
            found |= {channel.name: channel for channel in member.channels.values()}
    return found


def place_of(driver: Driver, channel: Channel) -> tuple[dict[str, Any], str]:
    """Returns where a channel has its value on the object: a dictionary, and the name in it."""
    part, _, word = channel.name.rpartition(".")
    return (vars(driver.__dict__[part]) if part else driver.__dict__), word


def services_of(kind: type[Driver]) -> dict[str, Service]:
    """Returns the services that programs call off the cycle, by name."""
    found = {n: getattr(m, "service", None) for base in reversed(kind.__mro__) for n, m in vars(base).items()}
    return {name: made for name, made in found.items() if isinstance(made, Service)}


def scanned(kind: type[Driver], options: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The devices that a class finds. Refused: it cannot look, an option that it does not have, an answer that is none."""
    name = kind.__name__
    if not _scans(kind):
        refuse(CallError, f"driver '{name}' cannot look for devices", "its manual says which options open one; def scan(cls) lets it look")
    declared = kind.members(_Option)
    for wrong in options.keys() - declared.keys():
        refuse(CallError, f"driver {name} has no option '{wrong}'", did_you_mean(wrong, declared))
    given = {n: declared[n].taken(_annotated(kind, n), value, f"option '{n}' of driver {name}") for n, value in options.items()}
    try:
        found = [{"what": str(device["what"]), "options": dict(device["options"])} for device in kind.scan(**given)]
    except (KeyError, TypeError, ValueError) as why:
        remedy = 'answer a list of {"what": text, "options": {name: value}}'
        refuse(DeviceFailed, f"what the scan of driver {name} answers is none: {type(why).__name__}: {why}", remedy)
    except Exception as why:
        refuse(DeviceFailed, f"driver {name} cannot look for devices: {type(why).__name__}: {why}")
    return found


def _scans(kind: type[Driver]) -> bool:
    return kind.scan.__func__ is not Driver.scan.__func__  # type: ignore[attr-defined]


def about(kind: type[Driver]) -> dict[str, Any]:
    """Returns the declaration of a driver, as manuals have it: `doc`, `options`, `services`, `counters`, `parts`, `scans`."""
    return {
        "doc": (inspect.getdoc(kind) or "").partition("\n")[0].rstrip("."),
        "options": [option.about(name, _annotated(kind, name)) for name, option in kind.members(_Option).items()],
        "services": [made.about() for made in services_of(kind).values()],
        "counters": [made.about() for made in kind.members(Counter).values()],
        "parts": [made.about() for made in kind.members(Part).values()],
        "scans": _scans(kind),
    }


def the_driver(members: Mapping[str, Any], module: str, where: str, name: str | None) -> type[Driver]:
    """The driver class of a module: the one of that name, or the only one that the module itself declares."""
    found = {n: m for n, m in members.items() if isinstance(m, type) and issubclass(m, Driver) and m.__module__ == module}
    if name is None and len(found) == 1:
        return next(iter(found.values()))
    if name is None:
        many: Sequence[str] = [*found]
        refuse(
            CallError,
            f"{where} has {len(many)} drivers{': ' if many else ''}{', '.join(many)}",
            "write a class on opengpac.driver.Driver, and name it",
        )
    chosen = members.get(name)
    if not (isinstance(chosen, type) and issubclass(chosen, Driver)):
        refuse(CallError, f"{where} has no driver '{name}'", did_you_mean(name, found))
    return chosen
