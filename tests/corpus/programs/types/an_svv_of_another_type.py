# SPDX-License-Identifier: Apache-2.0
"""An SVV of type float is bound to an output of type double."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

y = cell.svv("y", "float")
wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator},
    instantiation_parameters={"y": "generator.y"},
    command_lists={"start": [activate("generator", every="1 ms")]},
)
wave.on(fast)(y)
