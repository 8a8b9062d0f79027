# SPDX-License-Identifier: Apache-2.0
"""A verb uses a port that the block does not have."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator},
    instantiation_parameters={"y": "generator.out"},
    command_lists={"start": [activate("generator", every="1 ms")]},
)
