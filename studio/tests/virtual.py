# SPDX-License-Identifier: Apache-2.0
"""A system whose virtual clock the page moves: a verb that changes its side at 2.02 s, 4.02 s, …; a ball of 2 kg that falls onto a box."""

from pathlib import Path

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib

blink = gpac.Verb(
    "blink",
    blocks={"wave": lib.signal_generator(frequency=0.25), "side": lib.comparator},
    cells={"y": ["wave.y", "side.u"]},
    modes={"side.u": "asynchronous"},
    command_lists={name: [activate("wave", every="20 ms"), activate("side", every="20 ms")] for name in ("low", "high")},
    initial="low",
    conditions={"rose": on("side.rose", during="low"), "fell": on("side.fell", during="high")},
    transitions={("low", "rose"): "high", ("high", "fell"): "low"},
    if_cut_off="continue",
)

cell = gpac.System("virtual", clock="virtual")
rtp = cell.processor("rtp0")
slow = rtp.timer("slow", period="20 ms", priority=60)
rtp.physical_device("bench", gpac.drivers.mujoco(Path(__file__).with_name("bench.xml"), contacts=4), exchange=slow)
blink.on(slow).asynch()
