# SPDX-License-Identifier: Apache-2.0
"""An angle is wired to an input that takes a force."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
code = cell.download("../../blocks.c")

wrong = gpac.Verb(
    "wrong",
    blocks={"angle": code.angle, "sink": code.force_sink},
    cells={"u": ["angle.y", "sink.u"]},
    command_lists={"start": [activate("angle", every="1 ms"), activate("sink")]},
)
wrong.on(fast)()
