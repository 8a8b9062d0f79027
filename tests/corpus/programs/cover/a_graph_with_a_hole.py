# SPDX-License-Identifier: Apache-2.0
"""An inner input of a graph is in no set of rho."""

import opengpac as gpac
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

smooth = gpac.Graph(
    "smooth",
    blocks={"gain": lib.gain, "filter": lib.lowpass},
    inputs={"u": "gain.u"},
    outputs={"y": "filter.y"},
)
