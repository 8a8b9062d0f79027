# SPDX-License-Identifier: Apache-2.0
"""One SVV is bound to a port of two numbers."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

q = cell.svv("q")
total = gpac.Verb(
    "total",
    blocks={"sum": lib.sum(n=2)},
    instantiation_parameters={"q": "sum.u"},
    modes={"sum.u": "asynchronous"},
    command_lists={"start": [activate("sum", every="1 ms")]},
)
total.on(fast)(q)
