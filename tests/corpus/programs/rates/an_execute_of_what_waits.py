# SPDX-License-Identifier: Apache-2.0
"""A block with a synchronous input is executed."""

import opengpac as gpac
from opengpac import execute
from opengpac import library as lib

cell = gpac.System("cell")
fast = cell.processor("rtp0").timer("fast", period="1 ms")

smooth = gpac.Verb(
    "smooth",
    blocks={"wave": lib.signal_generator, "filter": lib.lowpass},
    cells={"raw": ["wave.y", "filter.u"]},
    command_lists={"start": [execute("wave"), execute("filter")]},
)
