# SPDX-License-Identifier: Apache-2.0
"""Entering definitions in a system, and checking them where they are made. The rules themselves are the model's, in Rust."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from . import _native
from .errors import refusals

if TYPE_CHECKING:
    from .devices import LogicalDevice
    from .graphs import Graph
    from .system import System
    from .verbs import Verb


class Definitions:
    """The verbs and device types that a system knows, by name, so that an equal definition is nothing."""

    def __init__(self, native: _native.System) -> None:
        self._native = native
        self._verbs: dict[str, str] = {}
        self._device_types: dict[str, str] = {}

    def enter_verb(self, verb: Verb[..., object]) -> None:
        """Enters a verb and the device types of its objects; another definition of the name replaces the one that was there."""
        for obj in verb.objects.values():
            self.enter_device_type(obj.device_type)
        text = verb.text()
        if self._verbs.get(verb.name) != text:
            with refusals:
                self._native.define_verb(text)
            self._verbs[verb.name] = text

    def enter_device_type(self, device_type: type[LogicalDevice]) -> None:
        """Enters a device type and the verb that keeps such a device going."""
        verb = device_type.definition_verb()
        if verb is not None:
            self.enter_verb(verb)
        name, text = device_type.definition_name(), json.dumps(device_type.definition_json())
        if self._device_types.get(name) != text:
            with refusals:
                self._native.define_device_type(text)
            self._device_types[name] = text


_alone: Definitions | None = None


def _without_system() -> Definitions:
    """Definitions that use the library only are checked against an empty system of their own."""
    global _alone
    if _alone is None:
        _alone = Definitions(_native.System("definitions", "virtual", "{}"))
    return _alone


def check_verb(verb: Verb[..., object], system: System | None) -> None:
    """Checks the names of a verb. One with blocks of a code module is checked by the system that has the module."""
    if system is None:
        _without_system().enter_verb(verb)
    else:
        system._check_verb(verb)


def check_graph(graph: Graph, system: System | None) -> None:
    """Checks the names and the cover of a graph."""
    native = system._native if system is not None else _without_system()._native
    with refusals:
        native.check_graph(json.dumps(graph.json()))


def check_device_type(device_type: type[LogicalDevice]) -> None:
    """Checks the members of a device type, if its verb uses the library only."""
    verb = device_type.definition_verb()
    if verb is None or verb.own_system() is None:
        _without_system().enter_device_type(device_type)
