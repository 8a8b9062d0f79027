# SPDX-License-Identifier: Apache-2.0
"""An SVV is bound to two elements of an output."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

a = cell.svv("a")
split = gpac.Verb(
    "split",
    blocks={"pair": code.pair},
    instantiation_parameters={"y": "pair.y"},
    command_lists={"start": [activate("pair", every="1 ms")]},
)
split.on(fast)([a, a])
