# SPDX-License-Identifier: Apache-2.0
"""An SVV is initialised from a member that does not exist."""

import opengpac as gpac

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)


class Axis(gpac.LogicalDevice):
    sensed: gpac.SVV[float] = gpac.svv()
    commanded: gpac.SVV[float] = gpac.svv(initial="sensd")


axis = Axis("axis", system=cell)
