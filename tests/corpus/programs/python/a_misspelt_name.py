# SPDX-License-Identifier: Apache-2.0
"""A name is misspelt."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms")
level = cell.svv("level")
slow = fats.processor.timer("slow", period="10 ms")
other = cell.svv("other", "flaot")
