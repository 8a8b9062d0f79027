# SPDX-License-Identifier: Apache-2.0
"""A class name is misspelt."""

import opengpac as gpac

cell = gpac.Sytem("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms")
other = gpac.System("other").svv("other", "flaot")
