# SPDX-License-Identifier: Apache-2.0
"""Two timers have the requested period."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

other = rtp.timer("other", period="1 ms", priority=70)
wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator},
    command_lists={"start": [activate("generator", every="1 ms")]},
)
wave.on(cell)()
