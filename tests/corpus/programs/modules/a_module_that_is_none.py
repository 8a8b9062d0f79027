# SPDX-License-Identifier: Apache-2.0
"""A file that is not a module is downloaded."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

code = cell.download(__file__)
