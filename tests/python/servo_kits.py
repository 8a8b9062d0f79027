# SPDX-License-Identifier: Apache-2.0
"""Ports of the kits that servo makers publish, on emulated servos."""

from __future__ import annotations

from typing import Any

import opengpac as gpac


def patient(handler: Any) -> Any:
    """Returns a port of a maker's kit without its time limit, which is shorter than a thread switch here may take."""

    class Patient(handler):
        def isPacketTimeout(self) -> bool:
            return self.getTimeSinceStart() > 60_000

    return Patient


def opened(handler: Any, bus: gpac.drivers.fake.FakeServos) -> Any:
    """Returns an open port of a maker's kit."""
    port = patient(handler)(bus.port)
    assert port.openPort() and port.setBaudRate(1_000_000)
    return port
