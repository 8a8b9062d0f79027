# SPDX-License-Identifier: Apache-2.0
"""Two SVVs have the same name."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

cell.svv("y")
cell.svv("y", "float")
