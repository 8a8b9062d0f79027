# SPDX-License-Identifier: Apache-2.0
"""Enables logical devices, either all or none."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

from .. import checking
from ..application.reports import Report, terminated
from ..errors import InvalidState, refusals, refuse

if TYPE_CHECKING:
    from ..system.system import System
    from .logical import LogicalDevice

_logger = logging.getLogger("opengpac")


def enable(devices: Sequence[LogicalDevice], timeout_ns: int | None) -> None:
    """Starts the verb instances of all `devices` and waits until each is ready; if one fails, disables all of them again."""
    if checking.active():
        return
    begun: list[LogicalDevice] = []
    identities: dict[str, int] = {}
    try:
        for device in devices:
            native = device.system._alive()
            if device.state in ("standstill", "moving"):
                continue
            with refusals:
                identities[device.name] = native.enable(device.name)
            begun.append(device)
        for device in begun[:1]:
            device.system._say_rights()
            _say_unguarded(device.system)
        for device in begun:
            with refusals:
                in_time = device.system._native.wait_enabled(device.name, timeout_ns)
            if not in_time:
                _not_ready(device, identities[device.name], timeout_ns)
        for device in begun:
            device._when_enabled()
    except BaseException:
        for device in begun:
            if device.state != "disabled":
                device.disable()
        raise


def _say_unguarded(system: System) -> None:
    """Warns once about each physical device that is not brought to its safe state if its process exits or hangs."""
    if system.virtual:
        return
    for name, device in system.physical_devices.items():
        why = device.about.get("unguarded_why")
        if why and name not in system._unguarded_said:
            system._unguarded_said.add(name)
            _logger.warning("%s", why)


def _not_ready(device: LogicalDevice, identity: int, timeout_ns: int | None) -> None:
    native, verb = device.system._native, device.verb
    if device.state in ("disabled", "fault") and identity and verb is not None:
        report = native.report(identity)
        if report is not None:
            raise terminated(Report(report), verb)
        refuse(InvalidState, f"device '{device.name}' was disabled before it was ready")
    raise TimeoutError(f"device '{device.name}' was not ready within {(timeout_ns or 0) * 1e-9:g} s; it is {device.state}")
