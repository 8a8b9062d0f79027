# SPDX-License-Identifier: Apache-2.0
"""Two structs have the same member names and different member types."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

points = gpac.Verb(
    "points",
    blocks={"source": code.point_source, "sink": code.small_point_sink},
    cells={"p": ["source.p", "sink.p"]},
    command_lists={"start": [activate("source", every="1 ms"), activate("sink")]},
)
points.on(fast)()
