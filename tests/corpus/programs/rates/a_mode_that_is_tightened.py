# SPDX-License-Identifier: Apache-2.0
"""An asynchronous input is made synchronous."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

servo = gpac.Verb(
    "servo",
    blocks={"servo": lib.joint_servo},
    input_parameters={"setpoint": "servo.setpoint", "position": "servo.position"},
    modes={"servo.setpoint": "synchronous", "servo.position": "asynchronous"},
    command_lists={"start": [activate("servo", every="1 ms")]},
)
