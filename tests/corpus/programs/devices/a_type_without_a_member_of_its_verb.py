# SPDX-License-Identifier: Apache-2.0
"""The verb of a device type has a parameter that is not bound."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
drive = rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=fast)

hold = gpac.Verb(
    "hold",
    blocks={"read": lib.read_channel},
    instantiation_parameters={"drive.position": "read.channel", "sensed": "read.y"},
    command_lists={"start": [activate("read", every="1 ms")]},
)


class Axis(gpac.LogicalDevice, verb=hold):
    low = gpac.parameter(0.0)


axis = Axis("axis", drive=drive["x"], on=fast)
