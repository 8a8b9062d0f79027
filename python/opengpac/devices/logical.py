# SPDX-License-Identifier: Apache-2.0
"""Logical devices: a class is a logical device type (an optional verb, SVVs, parameters), an object is a logical device."""

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
"""A range: two ends, or a text, `"(0, inf)"`, where a round bracket excludes its end."""


class SvvMember:
    """An SVV of a device type; made by `gpac.svv`. On a device it is that device's SVV."""

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
        """The form that the model takes."""
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
    """The type in `sensed: gpac.SVV[float]`; `double` without one."""
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
    """An SVV of a device type. `type` and `unit` are those of `cell.svv`; `history` is how many last values are kept.

    `initial="sensed"` copies that member once when the device is enabled; else it is a value.

    `keep`: its value survives a warm restart (an offset that homing has found). `within` is the range of what Python may store:
    `"[0, inf)"`, or two ends, each a number or a parameter of the device: `("position_min", "position_max")`.
    `shared="name"`: the devices have none of their own but share the system's SVV of that name, which is made with the first of them.
    `reading`: it says something of the machine, so of a device that was never enabled it is refused (`NotEnabled`): nobody has read it.
    """
    kept = whole(history, "the history of an SVV", 0, 2**32 - 1)
    return SvvMember(type, unit, initial, kept, keep, range_of(within, "the range of an SVV"), shared, reading)


class ParameterMember:
    """A parameter of a device type; made by `gpac.parameter`. On a device it is its value, and setting it changes it."""

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
        """The form that the model takes."""
        default = plain(self.default, f"the default of parameter '{self.name}'")
        ranged = {} if self.within is None else {"within": self.within}
        return {"default": default, "unit": self.unit, "tunable": self.tunable, **ranged}


@taking
def parameter(default: Any, *, unit: str = "", tunable: bool = False, keep: bool | None = None, within: Within | None = None) -> Any:
    """A parameter of a device type, with its `default` and `unit`.

    `within` is its range: `"(0, inf)"` for numbers above 0, or two ends, each a number or another parameter of the device, before which
    a minus may stand. A value outside raises `OutOfRange`, when the device is made and when the parameter is set.

    A `tunable` one may be set while the device's verb runs; others take effect at its next start.

    `keep`: its value survives a warm restart; left out, that of a tunable one does.
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

    `Joint("elbow", drive=ur5e["elbow"], on=fast)` makes a device: `name` is its own in the system, `on` is where its verb runs (or `system`
    says in which system it is, where nothing else does), the other arguments are its verb's, or override parameters;
    `every={"read": "5 ms"}` changes intervals of its verb's blocks. `units={"rad": "m"}` says which parts of the type's units are others
    for this device: a sliding joint. `verb` keeps this one going in place of its type's verb, where its drive is commanded in another
    way. It must be enabled before verbs may use it.

    `arbitration` says what happens to a verb that needs something of the device that another verb holds: `"refuse"` (the default:
    `SecondWriter` names both), `"queue"` (its start waits, in order) or `"abort"` (the other ends with `aborted`, and it follows).
    The type says it for all its devices, `class Joint(..., arbitration="queue")`, and `Joint(..., arbitration="abort")` for one.

    Raises `InUse` for a name that is taken, `CallError` for an argument that is not known and where no system can hold it,
    `DefinitionError` for another `arbitration`, and what the creation of its verb raises; it is made whole or not at all.
    """

    _definition_kind = "device_types"
    """What its type is in a file of definitions."""

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
                f"{len(candidates)} systems could hold {type(self).__name__} '{name}'",
                "say on=source, of one system, or system=cell",
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
        """Makes it the device of its name in its system. Its SVVs are those that the name has now, and stay so."""
        self._member_svvs = {
            name: SVV(self.system, member.shared or f"{self.name}.{name}") for name, member in self.svv_members().items()
        }  # fmt: skip
        for name, member in self.svv_members().items():
            self._member_svvs[name]._reading_of = self if member.reading else None
        self._numbers = [svv._asked for svv in self._member_svvs.values()]
        self.system.devices[self.name] = self

    def _here(self) -> RealTimeSystem:
        """The system that it is in. Refused where the device was deleted and another has its name."""
        other = self.system.devices.get(self.name)
        if other is not None and other is not self and (other.definition_name(), other._numbers) != (self.definition_name(), self._numbers):
            refuse(
                UnknownName,
                f"the {self.definition_name()} '{self.name}' that this stands for is gone: it was deleted, and a "
                f"{other.definition_name()} has its name",
                "use the one that was made last",
            )
        return self.system._alive()

    @classmethod
    def definition_name(cls) -> str:
        """The name of the type."""
        return cls._definition.name

    @classmethod
    def definition_verb(cls) -> Verb[..., Any] | None:
        """The verb that keeps such a device going."""
        return cls._definition.verb

    @property
    def verb(self) -> Verb[..., Any] | None:
        """The verb that keeps this device going: its type's, or the one that it was given."""
        return self._own_verb or self.definition_verb()

    @classmethod
    def parameter_members(cls) -> dict[str, ParameterMember]:
        """Its parameters by name."""
        return cls._members(ParameterMember)

    @classmethod
    def svv_members(cls) -> dict[str, SvvMember]:
        """Its SVVs by name."""
        return cls._members(SvvMember)

    @classmethod
    def _members(cls, kind: type[Any]) -> dict[str, Any]:
        return {n: m for base in reversed(cls.__mro__) for n, m in base.__dict__.items() if isinstance(m, kind)}

    @classmethod
    def definition_json(cls) -> dict[str, Any]:
        """The form that the model takes."""
        verb = cls.definition_verb()
        return {
            "name": cls.definition_name(), "doc": (cls.__doc__ or "").strip(), "verb": verb.name if verb else None,
            "svvs": {n: m.json(cls) for n, m in cls.svv_members().items()},
            "parameters": {n: m.json() for n, m in cls.parameter_members().items()},
            "arbitration": cls._definition.arbitration, "place": cls._definition.place.json(),
        }  # fmt: skip

    @classmethod
    def definition_text(cls) -> str:
        """`definition_json` as text, made once: a definition does not change."""
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
        """The last word of its name: `elbow` of `arm.elbow`."""
        return self.name.rsplit(".", 1)[-1]

    @property
    def state(self) -> str:
        """`disabled`, `enabling`, `standstill`, `moving`, `stopping` or `fault`."""
        with refusals:
            return self._here().device_state(self.name)

    def enable(self, timeout: Quantity | None = "10 s") -> Self:
        """Starts its verb instance and returns when that has come to `gpac.ready()`. Idempotent.

        After `timeout` `TimeoutError` comes, and it is disabled again; where its verb ends before, that end's exception.
        """
        self._here()
        enable([self], optional_ns(timeout, "the timeout"))
        return self

    def _when_enabled(self) -> None:
        """Called once `enable` has found it ready: a type says here what its user should know."""

    def disable(self) -> None:
        """Ends the verbs that use it with `device_disabled`, then its own."""
        with refusals:
            self._here().disable(self.name)

    def exchange_verb(self, verb: Verb[..., Any]) -> None:
        """Replaces the verb that keeps it going, within one firing where it is enabled; verbs that use the device run on.

        The new verb takes the same arguments, members and parameters. Blocks of the same label and code keep their states, cells of the
        same name their values. Where something is refused nothing has changed. Both verbs lie in one interrupt source.
        """
        self.system._enter_verb(verb)
        with refusals:
            self._here().exchange_verb(self.name, verb.name, here().json())
        self._own_verb = verb

    @contextmanager
    def enabled(self, timeout: Quantity | None = "10 s") -> Generator[Self]:
        """Enables the device: `with joint.enabled():` disables it at the end; `timeout` is that of `enable`."""
        self.enable(timeout)
        try:
            yield self
        finally:
            if not self.system.closed:
                self.disable()

    def delete(self) -> None:
        """Takes it away, with its SVVs and its verb instance; refused while it is enabled or in use."""
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
    """Refuses a word that is none of the three."""
    if arbitration not in ("refuse", "queue", "abort"):
        refuse(DefinitionError, f"{what} has arbitration={arbitration!r}", "write 'refuse', 'queue' or 'abort'")
