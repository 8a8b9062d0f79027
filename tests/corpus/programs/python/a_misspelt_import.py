# SPDX-License-Identifier: Apache-2.0
"""An import is misspelt."""

import opengpac as gpac
from opengpac import activate, excute

cell = gpac.System("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms")
lists = {"start": [excute("wave"), activate("wave", every="1 ms")]}
other = cell.svv("other", "flaot")
