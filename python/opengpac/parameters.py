# SPDX-License-Identifier: Apache-2.0
"""Parameters of verbs: input parameters with defaults and units, and objects that are logical devices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .blocks import Names, names_of
from .errors import DefinitionError, refuse
from .places import Place, here
from .values import plain

if TYPE_CHECKING:
    from .devices import LogicalDevice

absent: Any = object()
"""What stands for a default that was not given."""


@dataclass(frozen=True)
class InputParameter:
    """A line of ψ; made by `gpac.input`."""

    targets: tuple[str, ...]
    default: Any
    tunable: bool
    unit: str
    place: Place

    @property
    def has_default(self) -> bool:
        """Whether a default was given here."""
        return self.default is not absent

    def json(self) -> dict[str, Any]:
        """The form that the model takes."""
        return {
            "targets": list(self.targets), "default": plain(self.default) if self.has_default else None, "tunable": self.tunable,
            "unit": self.unit, "place": self.place.json(),
        }  # fmt: skip


def input(targets: Names, *, default: Any = absent, tunable: bool = False, unit: str = "") -> Any:
    """An input parameter: where its value is stored at each start, its default, and whether `vi.set(...)` may change it."""
    return InputParameter(tuple(names_of(targets)), default, tunable, unit, here())


def input_of(given: Any) -> InputParameter:
    """A value of `input_parameters=`: `gpac.input(...)`, one name or several."""
    return given if isinstance(given, InputParameter) else input(given)


@dataclass(frozen=True)
class Object:
    """What logical devices a verb acts on: one of a type, or several."""

    device_type: type[LogicalDevice]
    each: bool = False

    def json(self) -> dict[str, Any]:
        """The form that the model takes."""
        return {"device_type": self.device_type.definition_name(), "each": self.each}


def each(device_type: type[LogicalDevice]) -> Object:
    """Several logical devices of a type: a group, or a sequence of devices."""
    return Object(device_type, True)


def objects_of(objects: Mapping[str, Any] | None) -> dict[str, Object]:
    """`objects=`: name → device type, or `gpac.each(type)`."""
    from .devices import LogicalDevice

    found: dict[str, Object] = {}
    for name, given in (objects or {}).items():
        if isinstance(given, type) and issubclass(given, LogicalDevice):
            given = Object(given)
        if not isinstance(given, Object):
            refuse(DefinitionError, f"object '{name}' is {given!r}", "give a class of logical devices, or gpac.each(class)")
        found[name] = given
    return found
