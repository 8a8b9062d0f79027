# SPDX-License-Identifier: Apache-2.0
"""Warm restart: data that a cell has accumulated, such as gains, offsets and the history of alarms, outlive its program. Motion is never
restored."""

from __future__ import annotations

import hashlib
import json
import logging
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Error, FileFailed, refusals, refuse
from ..storage import files
from ..values.encoding import plain

if TYPE_CHECKING:
    from ..devices.logical import LogicalDevice
    from .system import System

FORMAT = 1

_logger = logging.getLogger("opengpac")


def save(system: System, path: Path) -> None:
    """Writes the data that survive a restart; the previous file is kept next to it, with `.previous` appended to its name."""
    devices = {name: _kept(device) for name, device in system.devices.items()}
    waiting = {**_restored_devices(system), **devices}
    with refusals:
        alarms = system._alive().alarms()
    now = [{**alarm, "active": False} for alarm in alarms["current"]]
    content = {"system": system.name, "devices": waiting, "alarms": (alarms["history"] + now)[-1000:]}
    text = json.dumps({"format": FORMAT, "checksum": _checksum(content), "content": content}, indent=1)
    files.write(path, text + "\n", "the restart file", previous=path.with_name(path.name + ".previous"))


def _restored_devices(system: System) -> Mapping[str, Any]:
    """Returns devices of the previous run that have not been created again, so that their data are not discarded."""
    return system._restored.devices if system._restored is not None else {}


def _kept(device: LogicalDevice) -> dict[str, Any]:
    parameters = {name: plain(getattr(device, name)) for name, member in device.parameter_members().items() if member.keep}
    svvs = {name: plain(getattr(device, name).value) for name, member in device.svv_members().items() if member.keep}
    return {"type": device.definition_name(), "parameters": parameters, "svvs": svvs}


def _checksum(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


class RestartContents:
    """Contents of a restart file: the data of devices that have not been created yet, and those that could not be restored."""

    def __init__(self, path: Path, content: Mapping[str, Any]) -> None:
        self.path = path
        self.devices: dict[str, Any] = dict(content["devices"])
        self.left_over: list[str] = []

    def apply(self, device: LogicalDevice) -> None:
        """Restores the data of a new device; data of members that its type does not have are reported as left over."""
        kept = self.devices.pop(device.name, None)
        if kept is None:
            return
        if kept["type"] != device.definition_name():
            self._leave(f"'{device.name}' was a {kept['type']}, but is now a {device.definition_name()}")
            return
        native = device.system._alive()
        for name, value in kept["parameters"].items():
            self._give(f"{device.name}.{name}", native.set_device_parameter, device.name, name, value)
        for name, value in kept["svvs"].items():
            full = f"{device.name}.{name}"
            self._give(full, native.write, full, value)

    def _give(self, what: str, call: Any, *arguments: Any) -> None:
        *names, value = arguments
        try:
            with refusals:
                call(*names, plain(value))
        except Error as error:
            self._leave(f"'{what}': {error.message}")

    def _leave(self, what: str) -> None:
        self.left_over.append(what)
        _logger.warning("not restored from '%s': %s", self.path, what)


def load(system: System, path: Path) -> RestartContents | None:
    """Reads a restart file into a new system; returns None on a first start, when the file does not exist yet."""
    text = files.read(path, "the restart file")
    if text is None:
        return None
    content = _content(text, path)
    with refusals:
        system._native.restore_alarms(content["alarms"])
    return RestartContents(path, content)


def _content(text: str, path: Path) -> dict[str, Any]:
    previous = path.with_name(path.name + ".previous")
    remedy = f"replace it with the previous one, '{previous}'" if previous.exists() else "move it away to start without it"
    try:
        document = json.loads(text)
        version, content = document["format"], document["content"]
        if version != FORMAT:
            refuse(FileFailed, f"restart file '{path}' has format {version!r}, but this version reads {FORMAT}", remedy)
        whole = document["checksum"] == _checksum(content) and _finite(content)
    except (ValueError, TypeError, KeyError, RecursionError):
        whole, content = False, {}
    if not whole:
        refuse(FileFailed, f"restart file '{path}' is damaged: it was truncated or changed", remedy)
    return content


def _finite(value: Any) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return all(_finite(v) for v in inner)
