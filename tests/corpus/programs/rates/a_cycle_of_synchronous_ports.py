# SPDX-License-Identifier: Apache-2.0
"""Two filters feed each other."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

ring = gpac.Verb(
    "ring",
    blocks={"a": lib.lowpass, "b": lib.lowpass},
    cells={"ab": ["a.y", "b.u"], "ba": ["b.y", "a.u"]},
    command_lists={"start": [activate("a"), activate("b")]},
)
