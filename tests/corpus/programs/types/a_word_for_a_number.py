# SPDX-License-Identifier: Apache-2.0
"""A string is passed where a number is expected."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

gain = gpac.Verb(
    "gain",
    blocks={"wave": lib.signal_generator, "gain": lib.gain(k="much")},
    cells={"u": ["wave.y", "gain.u"]},
    command_lists={"start": [activate("wave", every="1 ms"), activate("gain")]},
)
gain.on(fast)()
