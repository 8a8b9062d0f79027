# SPDX-License-Identifier: Apache-2.0
"""The application sets an interval for a driven block."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

smooth = gpac.Verb(
    "smooth",
    blocks={"wave": lib.signal_generator, "filter": lib.lowpass},
    cells={"raw": ["wave.y", "filter.u"]},
    command_lists={"start": [activate("wave", every="1 ms"), activate("filter")]},
)
smooth.on(fast, every={"filter": "2 ms"})()
