# SPDX-License-Identifier: Apache-2.0
"""A constant is too large for its type."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

level = gpac.Verb(
    "level",
    blocks={"small": code.small(level=300)},
    command_lists={"start": [activate("small", every="1 ms")]},
)
level.on(fast)()
