# SPDX-License-Identifier: Apache-2.0
"""A ratio input of 5 has a writer at half of its rate."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

slow_input = gpac.Verb(
    "slow_input",
    blocks={"wave": lib.signal_generator, "averager": code.averager},
    cells={"u": ["wave.y", "averager.u"]},
    command_lists={"start": [activate("wave", every="2 ms"), activate("averager", every="1 ms")]},
)
slow_input.on(fast)()
