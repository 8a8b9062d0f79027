# SPDX-License-Identifier: Apache-2.0
"""Two blocks that run together write the same channel."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
drive = rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=fast)

both = gpac.Verb(
    "both",
    blocks={"one": lib.write_channel(u=1.0), "two": lib.write_channel(u=2.0)},
    instantiation_parameters={"drive.effort": ["one.channel", "two.channel"]},
    command_lists={"start": [activate("one", every="1 ms"), activate("two", every="1 ms")]},
)
both.on(fast)(drive["x"])
