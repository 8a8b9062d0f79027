# SPDX-License-Identifier: Apache-2.0
"""A verb uses a channel that the device does not have."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
drive = rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=fast)

reading = gpac.Verb(
    "reading",
    blocks={"read": lib.read_channel},
    instantiation_parameters={"drive.positon": "read.channel"},
    command_lists={"start": [activate("read", every="1 ms")]},
)
reading.on(fast)(drive["x"])
