# SPDX-License-Identifier: Apache-2.0
"""Empties a remote system when its program leaves it, as if it were embedded: all verbs end, all devices are disabled, and the program's
objects are deleted."""

from __future__ import annotations

import contextlib

from .. import _native
from ..system.realtime import RealTimeSystem


def leave_empty(system: RealTimeSystem) -> None:
    """Halts the actions, disables the devices, then deletes instances, devices and SVVs. Processors, sources and definitions are kept.

    Objects that another session uses cannot be deleted, and are kept too.
    """
    actions = [i for i in system.statistics()["instances"] if i["owner"] is None]
    for action in actions:
        if action["state"] in ("queued", "running", "suspended"):
            with contextlib.suppress(_native.Refused):
                system.halt(action["id"])
    devices = system.names()
    for name in devices["logical_devices"]:
        if system.device_state(name) != "disabled":
            with contextlib.suppress(_native.Refused):
                system.disable(name)
    for action in actions:
        with contextlib.suppress(_native.Refused):
            system.delete(action["id"])
    for name in devices["logical_devices"]:
        with contextlib.suppress(_native.Refused):
            system.delete_device(name)
    for name in system.names()["svvs"]:
        with contextlib.suppress(_native.Refused):
            system.delete_svv(name)
    for name in devices["devices"]:
        with contextlib.suppress(_native.Refused):
            system.delete_physical_device(name)
