# SPDX-License-Identifier: Apache-2.0
"""Drives on EtherCAT and CANopen for the campaign of kills: emulated drives whose own watchdog stops them when commands cease."""

from __future__ import annotations

import opengpac as gpac

COUNTS = 1_000
"""Counts of an axis per rad."""
WATCHDOG = "1 s"
"""Watchdog of the drives: a longer pause between commands has causes other than a busy machine."""
LOST_AFTER = 600
"""Number of cycles without an answer, 3 s at 5 ms."""


class Axis:
    """Drive in operation, and the driver for it."""

    channel = "a.goal"
    value = 0.5

    @property
    def address(self) -> str:
        return self.peer.interface

    def __init__(self, peer: gpac.drivers.fake.EtherCatSegment | gpac.drivers.fake.CanOpenBus) -> None:
        self.peer = peer

    def commanded(self) -> bool:
        """Returns whether the drive moves."""
        return self.peer.drives()[0].position > 0

    def safe(self) -> bool:
        """Returns whether the drive is switched off, by command or by its own watchdog."""
        return self.peer.drives()[0].drive != "operation enabled"

    def close(self) -> None:
        self.peer.close()


def ethercat(address: str) -> gpac.drivers.Driver:
    """Returns the driver of a drive on a segment."""
    return gpac.drivers.ethercat(address, {"a": {"counts": COUNTS, "speed_max": 1.0}}, timeout=WATCHDOG, lost_after=LOST_AFTER)


def canopen(address: str) -> gpac.drivers.Driver:
    """Returns the driver of a drive on a bus."""
    axis = {"node": 1, "counts": COUNTS, "speed_max": 1.0}
    return gpac.drivers.canopen(address, {"a": axis}, cycle="5 ms", timeout=WATCHDOG, heartbeat=WATCHDOG, lost_after=LOST_AFTER)
