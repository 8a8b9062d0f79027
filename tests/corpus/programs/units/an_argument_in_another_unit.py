# SPDX-License-Identifier: Apache-2.0
"""A call passes a quantity of another dimension for an input parameter."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms")

waving = gpac.Verb(
    "waving",
    blocks={"wave": lib.signal_generator},
    input_parameters={"frequency": gpac.input("wave.frequency", default=1.0)},
    command_lists={"start": [activate("wave", every="1 ms")]},
)
waving.on(fast)(frequency="50 rad")
