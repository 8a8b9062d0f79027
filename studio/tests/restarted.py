# SPDX-License-Identifier: Apache-2.0
"""A system that blinks: the daemon of the test that starts it again."""

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib

blink = gpac.Verb(
    "blink",
    blocks={"wave": lib.signal_generator(shape=1, frequency=2.0), "side": lib.comparator},
    cells={"y": ["wave.y", "side.u"]},
    modes={"side.u": "asynchronous"},
    command_lists={name: [activate("wave", every="20 ms"), activate("side", every="20 ms")] for name in ("off", "on")},
    initial="off",
    conditions={"rose": on("side.rose", during="off"), "fell": on("side.fell", during="on")},
    transitions={("off", "rose"): "on", ("on", "fell"): "off"},
    if_cut_off="continue",
)

cell = gpac.System("cell")
blink.on(cell.processor("rtp0").timer("slow", period="20 ms", priority=60)).asynch()
