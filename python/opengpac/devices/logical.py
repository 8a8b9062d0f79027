# SPDX-License-Identifier: Apache-2.0
"""Logical devices. A class is a logical device type (an optional verb, SVVs, parameters), and an instance of it is a logical device."""

from __future__ import annotations

import inspect
import json
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeAlias, get_args, get_origin

from ..application.arguments import Argument, argument_json, systems_in
from ..definition.entering import check_device_type
from ..definition.modules import PYTHON_TYPES, type_json
from ..errors import CallError, DefinitionError, Error, UnknownName, did_you_mean, gone, refusals, refuse
from ..refusals.argument_types import all_taking, taking, whole
from ..refusals.declared_names import DeclaredNames
from ..refusals.source_location import Place, here
from ..studio import offered_motions
from ..system.svvs import SVV, rows_of
from ..values.encoding import lively, plain
from ..values.numbers import range_of
from ..values.quantities import Quantity, optional_ns, span_ns
from ..values.tables import Table, TableDisplay
from .enabling import enable

if TYPE_CHECKING:
    from ..definition.verbs import Verb
    from ..system.realtime import RealTimeSystem
    from ..system.sources import Source
    from ..system.system import System


Within: TypeAlias = tuple[float | str, float | str] | str
"""A range: two bounds, or a text such as `"(0, inf)"`, in which a parenthesis excludes the bound."""


class SvvMember:
    """An SVV of a device type. Created by `gpac.svv`. As an attribute of a device it returns the device's SVV."""

    def __init__(
        self,
        type: Any,
        unit: str,
        initial: Any,
        history: int,
        keep: bool = False,
        within: str | list[float | str] | None = None,
        shared: str | None = None,
        reading: bool = False,
    ) -> None:
        self.type, self.unit, self.initial, self.history, self.keep = type, unit, initial, history, keep
        self.within, self.shared, self.reading = within, shared, reading
        self.name = ""

    def __set_name__(self, owner: type[LogicalDevice], name: str) -> None:
        self.name = name

    def __get__(self, device: LogicalDevice | None, owner: type[LogicalDevice]) -> Any:
        return self if device is None else self._of(device)

    def __set__(self, device: LogicalDevice, value: Any) -> None:
        self._of(device).value = value

    def _of(self, device: LogicalDevice) -> SVV[Any]:
        return device._member_svvs[self.name]

    def json(self, owner: type[LogicalDevice]) -> dict[str, Any]:
        """Returns the SVV in the model's format."""
        text, _ = type_json(self.type or _annotated(owner, self.name), f"SVV '{self.name}' of {owner.__name__}")
        initial: Any = None
        if isinstance(self.initial, str) and self.initial.isidentifier():
            initial = {"copy_of": self.initial}
        elif self.initial is not None:
            initial = {"value": plain(self.initial, f"the initial value of '{self.name}'")}
        return {
            "type_text": text, "unit": self.unit, "initial": initial, "history": self.history,
            "within": self.within, "shared": self.shared,
        }  # fmt: skip


def _annotated(owner: type, name: str) -> Any:
    """Returns the annotated type, as in `sensed: gpac.SVV[float]`, or `double` if there is no annotation."""
    for kind in owner.__mro__:
        given = inspect.get_annotations(kind).get(name)
        if isinstance(given, str):
            inner = given[given.index("[") + 1 : -1] if given.endswith("]") else "float"
            return PYTHON_TYPES.get(inner, inner.strip("'\""))
        if given is not None and get_origin(given) is SVV:
            argument = get_args(given)[0]
            return getattr(argument, "__forward_arg__", argument)
    return float


@taking
def svv(
    type: Any = None,
    *,
    unit: str = "",
    initial: Any = None,
    history: int = 0,
    keep: bool = False,
    within: Within | None = None,
    shared: str | None = None,
    reading: bool = False,
) -> Any:
    """Declares an SVV of a device type. `type` and `unit` are as in `cell.svv`; `history` is the number of most recent values that are
    kept.

    `initial` is the initial value, or the name of a member, `"sensed"`, whose value is copied once when the device is enabled.

    With `keep`, its value survives a warm restart, as an offset found by homing must. `within` is the range of values that Python may
    store: `"[0, inf)"`, or two bounds, each a number or a parameter of the device: `("position_min", "position_max")`. With
    `shared="name"`, the devices share the system's SVV of that name, which is created with the first device. With `reading`, its
    value describes the machine; reading it on a device that was never enabled is refused (`NotEnabled`).
    """
    kept = whole(history, "the history of an SVV", 0, 2**32 - 1)
    return SvvMember(type, unit, initial, kept, keep, range_of(within, "the range of an SVV"), shared, reading)


class ParameterMember:
    """A parameter of a device type. Created by `gpac.parameter`. As an attribute of a device it is the value, and can be set."""

    def __init__(
        self, default: Any, unit: str, tunable: bool, keep: bool | None = None, within: str | list[float | str] | None = None
    ) -> None:
        self.default, self.unit, self.tunable, self.within = default, unit, tunable, within
        self.keep = tunable if keep is None else keep
        self.name = ""

    def __set_name__(self, owner: type[LogicalDevice], name: str) -> None:
        self.name = name

    def __get__(self, device: LogicalDevice | None, owner: type[LogicalDevice]) -> Any:
        if device is None:
            return self
        with refusals:
            return lively(device._here().device_parameter(device.name, self.name))

    def __set__(self, device: LogicalDevice, value: Any) -> None:
        with refusals:
            device._here().set_device_parameter(device.name, self.name, plain(value, f"parameter '{self.name}' of device '{device.name}'"))

    def json(self) -> dict[str, Any]:
        """Returns the parameter in the model's format."""
        default = plain(self.default, f"the default of parameter '{self.name}'")
        ranged = {} if self.within is None else {"within": self.within}
        return {"default": default, "unit": self.unit, "tunable": self.tunable, **ranged}


@taking
def parameter(default: Any, *, unit: str = "", tunable: bool = False, keep: bool | None = None, within: Within | None = None) -> Any:
    """Declares a parameter of a device type, with its `default` and `unit`.

    `within` is its range: `"(0, inf)"` for numbers above 0, or two bounds, each a number or another parameter of the device,
    optionally negated. A value outside raises `OutOfRange`, when the device is created and when the parameter is set.

    A `tunable` parameter can be set while the device's verb runs; others take effect at its next start.

    With `keep`, its value survives a warm restart; by default, this applies only to tunable parameters.
    """
    return ParameterMember(default, unit, tunable, keep, range_of(within, "the range of a parameter"))


@dataclass(frozen=True)
class _Definition:
    name: str
    verb: Verb[..., Any] | None
    arbitration: str
    place: Place


@all_taking
class LogicalDevice(TableDisplay, DeclaredNames, Argument):
    """Base of logical device types: `class Joint(gpac.LogicalDevice, verb=servo)` with members `gpac.svv` and `gpac.parameter`.

    `Joint("elbow", drive=ur5e["elbow"], on=fast)` creates a device: `name` is unique in the system, and `on` is the placement of its
    verb. `system` is the device's system, needed only if no other argument determines it. The other arguments are those of its verb,
    or override parameters. `every={"read": "5 ms"}` changes intervals of its verb's blocks. `units={"rad": "m"}` replaces components
    of the type's units for this device, for example for a prismatic joint. `verb` replaces the type's verb for this device, if its
    drive is commanded differently. A device must be enabled before verbs may use it.

    `arbitration` decides what happens if a verb needs a resource of the device that another verb holds: `"refuse"` (the default:
    `SecondWriter` names both), `"queue"` (its start waits in a queue) or `"abort"` (the other verb ends with `aborted`, then it
    starts). `class Joint(..., arbitration="queue")` sets it for all devices of the type, `Joint(..., arbitration="abort")` for one
    device.

    Raises `InUse` for a name that is taken, `CallError` for an unknown argument or if the system is undetermined, `DefinitionError`
    for an invalid `arbitration`, and the errors that creating its verb can raise; the device is created completely or not at all.
    """

    _definition_kind = "device_types"
    """Section of a definition file that holds device types."""

    _definition: ClassVar[_Definition]
    _text: ClassVar[tuple[_Definition, str]]
    _own_verb: Verb[..., Any] | None = None

    def __init_subclass__(
        cls, *, verb: Verb[..., Any] | None = None, name: str | None = None, arbitration: str | None = None, **kwargs: Any
    ) -> None:
        super().__init_subclass__(**kwargs)
        inherited = cls.__dict__.get("_definition") or getattr(cls, "_definition", None)
        decided: str = arbitration or (inherited.arbitration if inherited else "refuse")
        check_arbitration(decided, f"device type '{cls.__name__}'")
        cls._definition = _Definition(name or cls.__name__, verb or (inherited.verb if inherited else None), decided, here())
        check_device_type(cls)
        if verb is not None and cls._definition.name not in verb._supported:
            verb._supported.append(cls._definition.name)

    def __init__(
        self,
        name: str,
        *,
        on: Source | None = None,
        system: System | None = None,
        every: Mapping[str, Quantity] | None = None,
        units: Mapping[str, str] | None = None,
        arbitration: str | None = None,
        verb: Verb[..., Any] | None = None,
        **arguments: Any,
    ) -> None:
        if arbitration is not None:
            check_arbitration(arbitration, f"device '{name}'")

        self.name = name
        parameters = self.parameter_members()
        overrides = {n: plain(v, f"parameter '{n}' of device '{name}'") for n, v in arguments.items() if n in parameters}
        given = {n: v for n, v in arguments.items() if n not in parameters}
        self._own_verb = verb
        verb = self.verb
        known = {p.split(".", 1)[0] for p in verb.instantiation_parameters} if verb else set()
        for wrong in (n for n in given if n not in known):
            refuse(
                CallError,
                f"{type(self).__name__} '{name}' has no parameter or argument '{wrong}'",
                did_you_mean(wrong, [*sorted(known), *parameters]),
            )
        candidates = (
            {s for v in given.values() for s in systems_in(v)}
            | ({on.system} if on is not None else set())
            | ({system} if system else set())
        )
        if len(candidates) != 1:
            refuse(
                CallError,
                f"it is not clear which of {len(candidates)} systems {type(self).__name__} '{name}' belongs to",
                "pass on=source, of one system, or system=cell",
            )
        self.system: System = candidates.pop()
        described = {
            "device_type": self.definition_name(),
            "verb": None if self._own_verb is None else self._own_verb.name,
            "parameters": overrides,
            "arguments": {n: argument_json(v, f"argument '{n}' of device '{name}'") for n, v in given.items()},
            "source": on.name if on is not None else None,
            "every": {label: span_ns(interval, f"the interval of '{label}'") for label, interval in (every or {}).items()},
            "units": [list(pair) for pair in (units or {}).items()],
            "arbitration": arbitration,
            "place": here().json(),
        }
        native = self.system._alive()
        self.system._definitions.enter_device_type(type(self))
        if self._own_verb is not None:
            self.system._definitions.enter_verb(self._own_verb)
        with refusals:
            native.device(described, name)
        self._enter()
        offered_motions.offer_for(self)
        if self.system._restored is not None:
            self.system._restored.apply(self)

    def _enter(self) -> None:
        """Registers the device by name in its system, and binds it permanently to the current SVVs of that name."""
        self._member_svvs = {
            name: SVV(self.system, member.shared or f"{self.name}.{name}") for name, member in self.svv_members().items()
        }  # fmt: skip
        for name, member in self.svv_members().items():
            self._member_svvs[name]._reading_of = self if member.reading else None
        self._numbers = [svv._asked for svv in self._member_svvs.values()]
        self.system.devices[self.name] = self

    def _here(self) -> RealTimeSystem:
        """Returns the device's system. Refuses a deleted device whose name has been reused by another device."""
        other = self.system.devices.get(self.name)
        if other is not None and other is not self and (other.definition_name(), other._numbers) != (self.definition_name(), self._numbers):
            refuse(
                UnknownName,
                f"this {self.definition_name()} '{self.name}' was deleted, and its name is now used by another device of type "
                f"{other.definition_name()}",
                "use the newer one",
            )
        return self.system._alive()

    @classmethod
    def definition_name(cls) -> str:
        """Returns the name of the type."""
        return cls._definition.name

    @classmethod
    def definition_verb(cls) -> Verb[..., Any] | None:
        """Returns the verb that keeps devices of this type running."""
        return cls._definition.verb

    @property
    def verb(self) -> Verb[..., Any] | None:
        """Verb that keeps this device running: the verb of its type, or the one passed to the device."""
        return self._own_verb or self.definition_verb()

    @classmethod
    def parameter_members(cls) -> dict[str, ParameterMember]:
        """Returns the parameters by name."""
        return cls._members(ParameterMember)

    @classmethod
    def svv_members(cls) -> dict[str, SvvMember]:
        """Returns the SVVs by name."""
        return cls._members(SvvMember)

    @classmethod
    def _members(cls, kind: type[Any]) -> dict[str, Any]:
        return {n: m for base in reversed(cls.__mro__) for n, m in base.__dict__.items() if isinstance(m, kind)}

    @classmethod
    def definition_json(cls) -> dict[str, Any]:
        """Returns the type in the model's format."""
        verb = cls.definition_verb()
        return {
            "name": cls.definition_name(), "doc": (cls.__doc__ or "").strip(), "verb": verb.name if verb else None,
            "svvs": {n: m.json(cls) for n, m in cls.svv_members().items()},
            "parameters": {n: m.json() for n, m in cls.parameter_members().items()},
            "arbitration": cls._definition.arbitration, "place": cls._definition.place.json(),
        }  # fmt: skip

    @classmethod
    def definition_text(cls) -> str:
        """Returns `definition_json` as text. Cached, because a definition does not change."""
        made = cls.__dict__.get("_text")
        if made is None or made[0] is not cls._definition:
            with refusals:
                made = cls._text = (cls._definition, json.dumps(cls.definition_json()))
        return made[1]

    def _argument(self) -> dict[str, Any]:
        self._here()
        return {"device": self.name}

    @property
    def short_name(self) -> str:
        """Last word of the name: `elbow` for `arm.elbow`."""
        return self.name.rsplit(".", 1)[-1]

    @property
    def state(self) -> str:
        """State: `disabled`, `enabling`, `standstill`, `moving`, `stopping` or `fault`."""
        with refusals:
            return self._here().device_state(self.name)

    def enable(self, timeout: Quantity | None = "10 s") -> Self:
        """Starts the device's verb instance and returns when it has reached `gpac.ready()`. Idempotent.

        After `timeout`, disables the device again and raises `TimeoutError`. If its verb ends earlier, raises the exception of that
        end.
        """
        self._here()
        enable([self], optional_ns(timeout, "the timeout"))
        return self

    def _when_enabled(self) -> None:
        """Called when `enable` has found the device ready. Types override it to report information to the user."""

    def disable(self) -> None:
        """Ends the verbs that use the device with `device_disabled`, and then the device's own verb."""
        with refusals:
            self._here().disable(self.name)

    def exchange_verb(self, verb: Verb[..., Any]) -> None:
        """Replaces the `verb` that keeps the device running, within one firing if it is enabled; verbs that use the device keep running.

        The new verb takes the same arguments, members and parameters. Blocks with the same label and code keep their states, and
        cells with the same name keep their values. A refused exchange changes nothing. Both verbs must run in one interrupt source.
        """
        self.system._enter_verb(verb)
        with refusals:
            self._here().exchange_verb(self.name, verb.name, here().json())
        self._own_verb = verb

    @contextmanager
    def enabled(self, timeout: Quantity | None = "10 s") -> Generator[Self]:
        """Enables the device; `with joint.enabled():` disables it at the end of the block. `timeout` is as in `enable`."""
        self.enable(timeout)
        try:
            yield self
        finally:
            if not self.system.closed:
                self.disable()

    def delete(self) -> None:
        """Deletes the device, with its SVVs and its verb instance; refused while it is enabled or in use."""
        with refusals:
            self._here().delete_device(self.name)
        self.system.devices.pop(self.name, None)

    def _table(self) -> Table | None:
        if self.system.closed:
            return None
        svvs = [getattr(self, name) for name in self.svv_members()]
        values = rows_of(self.system, svvs)[1] if svvs else []
        rows = [(name, value, svv.unit, "SVV") for name, svv, (value, *_) in zip(self.svv_members(), svvs, values, strict=True)]
        for name, member in self.parameter_members().items():
            rows.append((name, getattr(self, name), member.unit, "tunable parameter" if member.tunable else "parameter"))
        return Table(f"{self.definition_name()} {self.name}: {self.state}", ["member", "value", "unit", "kind"], rows)

    def __repr__(self) -> str:
        try:
            state = "in a closed system" if self.system.closed else self.state
        except Error as error:
            state = gone(error)
        members = ", ".join([*self.svv_members(), *self.parameter_members()])
        return f"{self.definition_name()} {self.name}: {state} ({members})"

    def _instead(self, name: str) -> str:
        return did_you_mean(name, [*self.svv_members(), *self.parameter_members()])

    def _called(self) -> str:
        return f"{self.definition_name()} '{self.name}'"


def check_arbitration(arbitration: str, what: str) -> None:
    """Refuses values other than the three arbitrations."""
    if arbitration not in ("refuse", "queue", "abort"):
        refuse(DefinitionError, f"arbitration= of {what} cannot be {arbitration!r}", "write 'refuse', 'queue' or 'abort'")
