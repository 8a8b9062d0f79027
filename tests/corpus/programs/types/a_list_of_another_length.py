# SPDX-License-Identifier: Apache-2.0
"""Three SVVs are bound to a port of two numbers."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

a, b, c = cell.svv("a"), cell.svv("b"), cell.svv("c")
total = gpac.Verb(
    "total",
    blocks={"sum": lib.sum(n=2)},
    instantiation_parameters={"q": "sum.u"},
    modes={"sum.u": "asynchronous"},
    command_lists={"start": [activate("sum", every="1 ms")]},
)
total.on(fast)([a, b, c])
