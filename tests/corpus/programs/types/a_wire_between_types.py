# SPDX-License-Identifier: Apache-2.0
"""A cell joins an output of type double and an input of type float."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator, "gain": code.float_gain},
    cells={"raw": ["generator.y", "gain.u"]},
    command_lists={"start": [activate("generator", every="1 ms"), activate("gain")]},
)
wave.on(fast)()
