# SPDX-License-Identifier: Apache-2.0
"""Only an input parameter reaches a synchronous input."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell")
fast = cell.processor("rtp0").timer("fast", period="1 ms")

smooth = gpac.Verb(
    "smooth",
    blocks={"filter": lib.lowpass},
    input_parameters={"raw": "filter.u"},
    command_lists={"start": [activate("filter", every="1 ms")]},
)
