# SPDX-License-Identifier: Apache-2.0
"""A keyword of the package is misspelt."""

import opengpac as gpac
from opengpac import activate, library

cell = gpac.System("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms")
wave = gpac.Verb(
    "wave",
    block={"wave": library.signal_generator},
    command_lists={"start": [activate("wave", every="1 ms")]},
)
wave.on(fast)()
other = cell.svv("other", "flaot")
