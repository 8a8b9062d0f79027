# SPDX-License-Identifier: Apache-2.0
"""A block without synchronous inputs is placed on a timer and has no interval."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator},
    command_lists={"start": [activate("generator")]},
)
wave.on(fast)()
