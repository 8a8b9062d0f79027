# SPDX-License-Identifier: Apache-2.0
"""A limit in N is set in rad."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

guard = gpac.Verb(
    "guard",
    blocks={"touch": code.touch(limit="3 rad")},
    input_parameters={"force": "touch.force"},
    modes={"touch.force": "asynchronous"},
    command_lists={"start": [activate("touch", every="1 ms")]},
)
guard.on(fast)(force=0.0)
