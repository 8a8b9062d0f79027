# SPDX-License-Identifier: Apache-2.0
"""A block that reads a device is placed on another processor."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
drive = rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=fast)

elsewhere = cell.processor("rtp1").timer("elsewhere", period="1 ms", priority=80)
reading = gpac.Verb(
    "reading",
    blocks={"read": lib.read_channel},
    instantiation_parameters={"drive.position": "read.channel"},
    command_lists={"start": [activate("read", every="1 ms")]},
)
reading.on(elsewhere)(drive["x"])
