# SPDX-License-Identifier: Apache-2.0
"""A block reads the last eight values of an SVV that keeps five."""

import opengpac as gpac
from opengpac import activate

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

code = cell.download("../../blocks.c")
u = cell.svv("u", history=5)
y = cell.svv("y")
slope = gpac.Verb(
    "slope",
    blocks={"slope": code.slope},
    instantiation_parameters={"u": "slope.u", "y": "slope.y"},
    command_lists={"start": [activate("slope", every="1 ms")]},
)
slope.on(fast)(u, y)
