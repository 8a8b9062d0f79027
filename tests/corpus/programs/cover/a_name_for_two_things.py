# SPDX-License-Identifier: Apache-2.0
"""A cell and an instantiation parameter have the same name."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator, "filter": lib.lowpass},
    instantiation_parameters={"y": "filter.y"},
    cells={"y": ["generator.y", "filter.u"]},
    command_lists={"start": [activate("generator", every="1 ms"), activate("filter")]},
)
