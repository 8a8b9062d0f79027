# SPDX-License-Identifier: Apache-2.0
"""A synchronous input is bound to an SVV that no block writes."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

raw = cell.svv("raw")
smooth = gpac.Verb(
    "smooth",
    blocks={"filter": lib.lowpass},
    instantiation_parameters={"raw": "filter.u"},
    command_lists={"start": [activate("filter")]},
)
smooth.on(fast)(raw)
