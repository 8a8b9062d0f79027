# SPDX-License-Identifier: Apache-2.0
"""Six servos on a serial bus, read and written in each exchange: the cost to the host, compared with the maker's own kit on the same
line."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator

from lines import Line, median, time

import opengpac as gpac
from opengpac import activate, library

JOINTS = 6
BAR_NS = 150_000.0
KINDS = ("feetech", "dynamixel")


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Yields one line per protocol."""
    for kind in KINDS:
        taken = [found for _ in range(rounds) for found in _exchanges(kind, 50 if quick else 500)]
        value = median(taken)
        yield Line(
            "servos",
            f"{kind}, {JOINTS} joints read and written, host's time",
            time(value),
            value=value,
            shown=time(value),
            bar=BAR_NS,
            bar_text=f"≤ {BAR_NS * 1e-3:.0f} µs",
            note=f"processor time of its thread, of {len(taken)} exchanges at 100 Hz; emulated servos on a pseudo terminal",
        )


def _exchanges(kind: str, count: int) -> list[float]:
    """Returns the host's processor time for exchanges in which every joint holds its goal, ns."""
    with gpac.drivers.fake.servos(kind, range(1, JOINTS + 1)) as bus, gpac.System("bench", progress=False) as cell:
        fast = cell.processor("rtp0").timer("fast", period="10 ms", priority=60)
        servos = {f"j{id}": {"id": id} for id in bus.servos}
        driver = getattr(gpac.drivers, kind)(bus.port, servos, latency="1 s", age_max="10 s", echo=False)
        device = fast.processor.physical_device("arm", driver, exchange=fast)
        for joint in servos:
            _hold().asynch(device[joint].goal, cell.svv(joint, unit="rad"))
        while not all(servo.torque for servo in bus.servos.values()):
            clock.sleep(0.01)
        taken: list[float] = []
        before = device.counters["exchanges"]
        while len(taken) < count:
            clock.sleep(0.01)
            counters = device.counters
            if counters["exchanges"] != before:
                before = counters["exchanges"]
                taken.append(float(counters["host_time"]))
        return taken


def _hold() -> gpac.Verb[..., gpac.Report]:
    """Returns a verb that writes a goal in each firing."""
    return gpac.Verb(
        "hold",
        blocks={"write": library.block("write_channel")},
        instantiation_parameters={"goal": "write.channel", "value": "write.u"},
        modes={"write.u": "asynchronous"},
        command_lists={"start": [activate("write", every="10 ms")]},
    )
