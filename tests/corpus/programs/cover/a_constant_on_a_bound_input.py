# SPDX-License-Identifier: Apache-2.0
"""An input has both a constant and a wire."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

smooth = gpac.Verb(
    "smooth",
    blocks={"wave": lib.signal_generator, "filter": lib.lowpass(u=1.0)},
    cells={"raw": ["wave.y", "filter.u"]},
    command_lists={"start": [activate("wave", every="1 ms"), activate("filter")]},
)
