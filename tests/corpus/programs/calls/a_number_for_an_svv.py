# SPDX-License-Identifier: Apache-2.0
"""A number is passed for an instantiation parameter."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator},
    instantiation_parameters={"y": "generator.y"},
    input_parameters={"amplitude": gpac.input("generator.amplitude", default=1.0)},
    command_lists={"start": [activate("generator", every="1 ms")]},
)
wave.on(fast)(3.0)
