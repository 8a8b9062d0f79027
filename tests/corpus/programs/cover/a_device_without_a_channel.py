# SPDX-License-Identifier: Apache-2.0
"""The channel of a reading block is bound nowhere."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

reading = gpac.Verb(
    "reading",
    blocks={"read": lib.read_channel},
    command_lists={"start": [activate("read", every="1 ms")]},
)
