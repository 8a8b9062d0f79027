# SPDX-License-Identifier: Apache-2.0
"""A small cell for tests: two processors, an arm of two joints, digital and analog signals that follow a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import opengpac as gpac
from opengpac.robots import Joint

MS = 1_000_000


def channel(name: str, direction: str = "read", type: str = "bool", **more: Any) -> dict[str, Any]:
    """Returns a channel of the scripted driver."""
    return {"name": name, "direction": direction, "type": type, **more}


CHANNELS = [
    channel("stop"), channel("stop2"), channel("closed"), channel("gate"), channel("enabling"), channel("pressure", type="double"),
    channel("valve", "write"), channel("valve_seen", loop_of="valve"),
    channel("heater", "write", "double", safe=-1.0), channel("heater_seen", type="double", loop_of="heater"),
]  # fmt: skip


class Bench:
    """Small cell. `rtp0`: `fast` (1 ms), `slow` (20 ms), the device `drives` with the group `arm` (x, y), `io`; `rtp1`: `far` (1 ms),
    `far_io`."""

    def __init__(self, cell: gpac.System, rows: Sequence[tuple[int, dict[str, Any]]] = (), **drives: Any) -> None:
        self.cell = cell
        self.rtp0, self.rtp1 = cell.processor("rtp0"), cell.processor("rtp1")
        self.fast = self.rtp0.timer("fast", period="1 ms", priority=80)
        self.slow = self.rtp0.timer("slow", period="20 ms", priority=60)
        self.far = self.rtp1.timer("far", period="1 ms", priority=80)
        table = [{"at_ns": at_ms * MS, "values": values} for at_ms, values in rows]
        self.drives = self.rtp0.physical_device("drives", gpac.drivers.loopback("x", "y", **drives), exchange=self.fast)
        self.io = self.rtp0.physical_device("io", gpac.drivers.scripted(CHANNELS, table), exchange=self.fast)
        self.far_io = self.rtp1.physical_device("far_io", gpac.drivers.scripted(CHANNELS), exchange=self.far)
        self.arm = gpac.Group("arm", *(Joint(f"arm.{p.name}", drive=p, on=self.fast, kp=50.0, kd=0.0) for p in self.drives))

    def output(self, name: str = "valve", far: bool = False) -> gpac.cell.DigitalOutput:
        """Returns the digital output, here or on the other processor, enabled."""
        device = (self.far_io if far else self.io)["valve"]
        return gpac.cell.DigitalOutput(name, device).enable()

    def ends(self) -> list[str]:
        """Returns the texts of the ends so far."""
        return [f"{entry['about']}: {entry['text']}" for entry in self.cell.log() if entry["kind"] == "end"]
