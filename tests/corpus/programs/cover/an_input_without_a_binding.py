# SPDX-License-Identifier: Apache-2.0
"""The input of the filter is not bound."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

smooth = gpac.Verb(
    "smooth",
    blocks={"filter": lib.lowpass},
    command_lists={"start": [activate("filter")]},
)
