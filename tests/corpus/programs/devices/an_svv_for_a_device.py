# SPDX-License-Identifier: Apache-2.0
"""An SVV is passed to a verb that acts on a device."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

hold = gpac.Verb(
    "hold",
    blocks={"read": lib.read_channel},
    instantiation_parameters={"drive.position": "read.channel", "sensed": "read.y"},
    command_lists={"start": [activate("read", every="1 ms")]},
)


class Axis(gpac.LogicalDevice, verb=hold):
    sensed: gpac.SVV[float] = gpac.svv()
    low = gpac.parameter(0.0)


act = gpac.Verb(
    "act",
    blocks={"filter": lib.lowpass},
    objects={"axis": Axis},
    instantiation_parameters={"axis.sensed": "filter.u"},
    modes={"filter.u": "asynchronous"},
    command_lists={"start": [activate("filter", every="1 ms")]},
)
act.on(fast)(cell.svv("y"))
