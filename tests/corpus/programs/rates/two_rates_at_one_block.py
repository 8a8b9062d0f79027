# SPDX-License-Identifier: Apache-2.0
"""Two synchronous inputs are written at different rates."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

mixed = gpac.Verb(
    "mixed",
    blocks={"a": lib.signal_generator, "b": lib.signal_generator, "servo": lib.pid},
    cells={"a": ["a.y", "servo.setpoint"], "b": ["b.y", "servo.measured"]},
    command_lists={"start": [activate("a", every="1 ms"), activate("b", every="2 ms"), activate("servo")]},
)
mixed.on(fast)()
