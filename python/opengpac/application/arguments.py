# SPDX-License-Identifier: Apache-2.0
"""Arguments of verbs and devices: SVVs, channels and parts of physical devices, logical devices and groups of devices."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..errors import CallError, refuse

if TYPE_CHECKING:
    from ..system.system import System

_SEVERAL = {"svv": "svvs", "device": "devices"}
"""Names of list arguments by the kind of their elements."""


class Argument:
    """Argument for an instantiation parameter or an object of a verb; it belongs to one `system`."""

    system: Any

    def _argument(self) -> dict[str, Any]:
        """Returns the argument in the model's format. Refuses a deleted object."""
        raise NotImplementedError


def argument_json(given: Any, what: str) -> dict[str, Any]:
    """Returns the argument of an instantiation parameter or object in the model's format. `what` names it in error messages."""
    if isinstance(given, Argument):
        return given._argument()
    if isinstance(given, list | tuple) and given and all(isinstance(each, Argument) for each in given):
        made = [each._argument() for each in given]
        for kind, several in _SEVERAL.items():
            if all(kind in each for each in made):
                return {several: [each[kind] for each in made]}
    refuse(CallError, f"{what} cannot be {given!r}", "pass an SVV, a channel or part of a physical device, or a logical device")


def systems_in(given: Any) -> Iterable[System]:
    """Yields the system of an argument, or of each element of a list argument."""
    if isinstance(given, Argument):
        return [given.system]
    if isinstance(given, list | tuple):
        return [system for each in given for system in systems_in(each)]
    return []
