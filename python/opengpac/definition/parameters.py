# SPDX-License-Identifier: Apache-2.0
"""Parameters of verbs: input parameters with defaults and units, and objects that are logical devices."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..devices.logical import LogicalDevice
from ..errors import REFUSALS, CallError, DefinitionError, Error, refuse
from ..refusals.argument_types import taking
from ..refusals.source_location import Place, here
from ..values.encoding import plain
from .blocks import Names, names_of

absent: Any = object()
"""Placeholder for a default that was omitted."""

Bound: TypeAlias = float | str
"""One bound of a range: a number, or a parameter of an object, `"arm.max_speed"`; a minus sign negates it."""


@dataclass(frozen=True)
class InputParameter:
    """One entry of ψ. Created by `gpac.input`."""

    targets: tuple[str, ...]
    default: Any
    tunable: bool
    unit: str
    place: Place
    within: tuple[Bound, Bound] | None = None
    counted_from: str | None = None
    member: str = ""
    form: Callable[[Any, Mapping[str, Any]], Any] | None = None

    @property
    def has_default(self) -> bool:
        """True if the definition provides a default."""
        return self.default is not absent

    def json(self) -> dict[str, Any]:
        """Returns the declaration in the model's format."""
        return {
            "targets": list(self.targets), "default": self.value(self.default, {}) if self.has_default else None, "tunable": self.tunable,
            "unit": self.unit, "within": None if self.within is None else list(self.within), "counted_from": self.counted_from,
            "place": self.place.json(),
        }  # fmt: skip

    def value(self, given: Any, objects: Mapping[str, Any], what: str = "the value") -> Any:
        """Returns the value of a call in the model's format. `what` names it in error messages."""
        return plain(self.form(given, objects) if self.form is not None else given, what)

    def of_object(self, name: str, objects: Mapping[str, Any]) -> Any:
        """Returns the attribute of the object that supplies the default."""
        root, _, rest = self.member.partition(".")
        try:
            return plain(operator.attrgetter(rest)(objects[root]))
        except (AttributeError, KeyError):
            refuse(
                CallError,
                f"'{name}' is missing, and {objects.get(root, root)!r} has no '{rest}' to use instead",
                f"pass {name}=, or an object that has it: an arm loaded with gpac.robots.load has a chain",
            )


@taking
def input(
    targets: Names,
    *,
    default: Any = absent,
    tunable: bool = False,
    unit: str = "",
    within: tuple[Bound, Bound] | None = None,
    counted_from: str | None = None,
    member: str = "",
    form: Callable[[Any, Mapping[str, Any]], Any] | None = None,
) -> Any:
    """Declares an input parameter: the ports (`targets`) that store its value at each start, its `default`, and whether `vi.set(...)`
    may change it (`tunable`). `unit` is the unit of its numbers if the ports have none.

    `within` is its range, checked before a start: numbers, or parameters of an object, `("arm.position_min", "arm.position_max")`,
    `("-arm.max_speed", "arm.max_speed")`; a value outside raises `OutOfRange`. With a range, `"30 %"` means that fraction of the
    maximum value, and a single number passed for an array applies to each device. With `counted_from="arm.commanded"`, the check
    applies to the sum of that SVV and the value.

    With `member="arm.chain"`, the default is that attribute of the object `arm`, read at each start. `form(given, objects)` converts
    the argument into the value for the ports, for example a short list into a table of fixed size.
    """
    if form is not None and not callable(form):
        refuse(CallError, f"form= must be a function, not {form!r}", "pass a function of the value and the objects")
    return InputParameter(tuple(names_of(targets)), default, tunable, unit, here(), within, counted_from, member, form)


@dataclass(frozen=True)
class Requirement:
    """Property that the devices of an object must have when a verb starts. Created by `required`."""

    raises: type[Error]
    when: str | None
    remedy: str
    place: Place

    def json(self) -> dict[str, Any]:
        """Returns the requirement in the model's format."""
        return {"raises": self.raises.__name__, "when": self.when, "remedy": self.remedy, "place": self.place.json()}


@taking
def required(raises: type[Error], *, when: str | None = None, remedy: str = "") -> Requirement:
    """Creates a value of `requires=`: the class that a start `raises` if the member is not true, and its `remedy`, the next step.

    `requires={"arm.homed": gpac.required(gpac.NotHomed, when="arm.needs_home")}`; `when` restricts it to devices whose member of that
    name is true. The class is one of this package's refusals, such as `gpac.NotHomed` or `gpac.InvalidState`.
    """
    if not isinstance(raises, type) or raises not in REFUSALS:
        refuse(
            DefinitionError,
            f"the class that a requirement raises must be an exception class of OpenGPAC, not {raises!r}",
            f"pass one of {', '.join(kind.__name__ for kind in REFUSALS)}",
        )
    return Requirement(raises, when, remedy, here())


def requirement_of(given: Any, name: str) -> Requirement:
    """Returns the requirement for a value of `requires=`: `gpac.required(...)`, or just a class."""
    if isinstance(given, Requirement):
        return given
    if isinstance(given, type) and issubclass(given, Error):
        return required(given)
    refuse(
        DefinitionError,
        f"requirement '{name}' must be an exception class or gpac.required(...), not {given!r}",
        "pass gpac.NotHomed, for example",
    )


def input_of(given: Any) -> InputParameter:
    """Returns the input parameter for a value of `input_parameters=`: `gpac.input(...)`, one name or several."""
    return given if isinstance(given, InputParameter) else input(given)


@dataclass(frozen=True)
class Object:
    """Logical devices on which a verb acts: one device of a type, or several."""

    device_type: type[LogicalDevice]
    each: bool = False

    def json(self) -> dict[str, Any]:
        """Returns the object declaration in the model's format."""
        return {"device_type": self.device_type.definition_name(), "each": self.each}


@taking
def each(device_type: type[LogicalDevice]) -> Object:
    """Declares several logical devices of the class `device_type`: a group, or a sequence of devices."""
    if not (isinstance(device_type, type) and issubclass(device_type, LogicalDevice)):
        refuse(
            DefinitionError,
            f"the argument of gpac.each() must be a class of logical devices, not {device_type!r}",
            "pass gpac.robots.Joint, for example",
        )
    return Object(device_type, True)


def objects_of(objects: Mapping[str, Any] | None) -> dict[str, Object]:
    """Converts `objects=`, whose values are device types or `gpac.each(type)`, to a mapping from names to objects."""
    found: dict[str, Object] = {}
    for name, given in (objects or {}).items():
        if isinstance(given, type) and issubclass(given, LogicalDevice):
            given = Object(given)
        if not isinstance(given, Object):
            refuse(
                DefinitionError,
                f"object '{name}' must be a class of logical devices, not {given!r}",
                "pass such a class, or gpac.each(class) for several devices",
            )
        found[name] = given
    return found
