# SPDX-License-Identifier: Apache-2.0
"""An output of a graph covers only an input."""

import opengpac as gpac
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

smooth = gpac.Graph(
    "smooth",
    blocks={"filter": lib.lowpass},
    outputs={"y": "filter.u"},
)
