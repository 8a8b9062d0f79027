# SPDX-License-Identifier: Apache-2.0
"""A graph divides the rate of a block that it does not have."""

import opengpac as gpac
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

smooth = gpac.Graph(
    "smooth",
    blocks={"wave": lib.signal_generator, "filter": lib.lowpass},
    cells={"raw": ["wave.y", "filter.u"]},
    divide={"estimator": 5},
)
