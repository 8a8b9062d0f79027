# SPDX-License-Identifier: Apache-2.0
"""Ports of the kits that makers of servos publish, on emulated servos."""

from __future__ import annotations

from typing import Any

import opengpac as gpac


def patient(handler: Any) -> Any:
    """A port of a maker's kit that waits as long as it must: its own time is less than a switch of threads here may take."""

    class Patient(handler):
        def isPacketTimeout(self) -> bool:
            return self.getTimeSinceStart() > 60_000

    return Patient


def opened(handler: Any, bus: gpac.drivers.fake.FakeServos) -> Any:
    """An open port of a maker's kit."""
    port = patient(handler)(bus.port)
    assert port.openPort() and port.setBaudRate(1_000_000)
    return port
