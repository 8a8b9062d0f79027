# SPDX-License-Identifier: Apache-2.0
"""An SVV in N is bound to an angle."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

y = cell.svv("y", unit="N")
wrong = gpac.Verb(
    "wrong",
    blocks={"angle": code.angle},
    instantiation_parameters={"y": "angle.y"},
    command_lists={"start": [activate("angle", every="1 ms")]},
)
wrong.on(fast)(y)
