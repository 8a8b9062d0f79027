# SPDX-License-Identifier: Apache-2.0
"""A list activates a block that does not exist."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

guard = gpac.Verb(
    "guard",
    blocks={"wave": lib.signal_generator, "touch": code.touch, "other": lib.signal_generator},
    cells={"force": ["wave.y", "touch.force"]},
    modes={"touch.force": "asynchronous"},
    command_lists={"start": [activate("wave", every="1 ms"), activate("tuoch", every="1 ms")]},
)
