# SPDX-License-Identifier: Apache-2.0
"""The type of an SVV is not a C type."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

y = cell.svv("y", "flot")
