# SPDX-License-Identifier: Apache-2.0
"""Two timers have the same name."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

rtp.timer("fast", period="2 ms", priority=70)
