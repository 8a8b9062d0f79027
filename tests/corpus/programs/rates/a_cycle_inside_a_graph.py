# SPDX-License-Identifier: Apache-2.0
"""A graph closes a loop of synchronous ports."""

import opengpac as gpac
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

ring = gpac.Graph(
    "ring",
    blocks={"a": lib.lowpass, "b": lib.gain},
    cells={"ab": ["a.y", "b.u"], "ba": ["b.y", "a.u"]},
)
