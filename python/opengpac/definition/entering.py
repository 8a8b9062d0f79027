# SPDX-License-Identifier: Apache-2.0
"""Registers definitions in a system, and checks them when they are created. The model, in Rust, defines the rules."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ..errors import refusals
from ..system.realtime import EmbeddedSystem, RealTimeSystem
from .blocks import BlockUse, modules_of

if TYPE_CHECKING:
    from ..devices.logical import LogicalDevice
    from ..system.system import System
    from .graphs import Graph
    from .verbs import Verb


class Definitions:
    """Verbs and device types registered in a system, by name, so that equal definitions are registered only once."""

    def __init__(self, native: RealTimeSystem) -> None:
        self.native = native
        self._verbs: dict[str, str] = {}
        self._device_types: dict[str, str] = {}
        self._modules: dict[str, tuple[str, int]] = {}

    def enter_module(self, name: str, path: str) -> list[dict[str, Any]]:
        """Downloads a code module of the component data base, and returns the interfaces of its blocks."""
        stamp = _stamp(path)
        with refusals:
            described = self.native.download(path, name, sys.executable or None)
        self._modules[name] = stamp
        return described["blocks"]

    def enter_modules(self, uses: Iterable[BlockUse]) -> None:
        """Downloads the code modules of the component data base that contain these blocks: each once, and again if its file has changed."""
        for name, path in modules_of(uses).items():
            if self._modules.get(name) != _stamp(path):
                self.enter_module(name, path)

    def enter_verb(self, verb: Verb[..., object]) -> None:
        """Registers a verb and the device types of its objects; replaces an earlier definition of the same name."""
        if verb.has_modules:
            self.enter_modules(verb.blocks.values())
        for obj in verb.objects.values():
            self.enter_device_type(obj.device_type)
        text = verb._text
        if self._verbs.get(verb.name) != text:
            with refusals:
                self.native.call("define_verb", text)
            self._verbs[verb.name] = text

    def enter_device_type(self, device_type: type[LogicalDevice]) -> None:
        """Registers a device type and the verb that keeps its devices running."""
        verb = device_type.definition_verb()
        if verb is not None:
            self.enter_verb(verb)
        name, text = device_type.definition_name(), device_type.definition_text()
        if self._device_types.get(name) != text:
            with refusals:
                self.native.call("define_device_type", text)
            self._device_types[name] = text


def _stamp(path: str) -> tuple[str, int]:
    """Returns a stamp that changes when the contents of a file change."""
    return path, os.stat(path).st_mtime_ns if os.path.exists(path) else 0


_alone: Definitions | None = None


def without_system() -> Definitions:
    """Returns the definitions of an empty system, used to check definitions that need only the component data base."""
    global _alone
    if _alone is None:
        with refusals:
            _alone = Definitions(EmbeddedSystem("definitions", "virtual", "{}"))
    return _alone


def check_verb(verb: Verb[..., object], system: System | None) -> None:
    """Checks the names of a verb. Verbs with blocks of a code module are checked by the system that downloaded it."""
    if system is None:
        without_system().enter_verb(verb)
    else:
        system._check_verb(verb)


def compose(parts: Iterable[Verb[..., object]], composition: Mapping[str, object], system: System | None) -> dict[str, Any]:
    """Composes the verbs into one definition, created and checked by the model."""
    definitions = system._definitions if system is not None else without_system()
    for part in parts:
        definitions.enter_modules(part.blocks.values())
        for obj in part.objects.values():
            definitions.enter_device_type(obj.device_type)
    with refusals:
        return definitions.native.compose(composition)
    raise AssertionError("`refusals` lets no exception pass silently")


def check_graph(graph: Graph, system: System | None) -> None:
    """Checks the names of a graph, and that each data node is covered exactly once."""
    definitions = system._definitions if system is not None else without_system()
    definitions.enter_modules(graph.blocks.values())
    with refusals:
        definitions.native.check_graph(graph.json())


def check_device_type(device_type: type[LogicalDevice]) -> None:
    """Checks the members of a device type if its verb uses only the library."""
    verb = device_type.definition_verb()
    if verb is None or verb.own_system() is None:
        without_system().enter_device_type(device_type)
