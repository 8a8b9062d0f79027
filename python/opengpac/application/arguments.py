# SPDX-License-Identifier: Apache-2.0
"""Arguments of verbs and devices: SVVs, channels and parts of physical devices, logical devices and groups of them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..errors import CallError, refuse

if TYPE_CHECKING:
    from ..system.system import System

_SEVERAL = {"svv": "svvs", "device": "devices"}
"""What a list of arguments is called, by what each of them is."""


class Argument:
    """Argument of an instantiation parameter or an object of a verb; it belongs to one `system`."""

    system: Any

    def _argument(self) -> dict[str, Any]:
        """The form that the model takes. Refused where it was deleted."""
        raise NotImplementedError


def argument_json(given: Any, what: str) -> dict[str, Any]:
    """Returns the argument of an instantiation parameter or object, as the model takes it; `what` it is, for a refusal."""
    if isinstance(given, Argument):
        return given._argument()
    if isinstance(given, list | tuple) and given and all(isinstance(each, Argument) for each in given):
        made = [each._argument() for each in given]
        for kind, several in _SEVERAL.items():
            if all(kind in each for each in made):
                return {several: [each[kind] for each in made]}
    refuse(CallError, f"{what} is {given!r}", "give an SVV, a channel or part of a physical device, or a logical device")


def systems_in(given: Any) -> Iterable[System]:
    """The systems of an argument, or of each in a list."""
    if isinstance(given, Argument):
        return [given.system]
    if isinstance(given, list | tuple):
        return [system for each in given for system in systems_in(each)]
    return []
