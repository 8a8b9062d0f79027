# SPDX-License-Identifier: Apache-2.0
"""Two blocks that run together write the same cell."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

both = gpac.Verb(
    "both",
    blocks={"one": lib.signal_generator, "two": lib.signal_generator},
    cells={"y": ["one.y", "two.y"]},
    command_lists={"start": [activate("one", every="1 ms"), activate("two", every="1 ms")]},
)
both.on(fast)()
