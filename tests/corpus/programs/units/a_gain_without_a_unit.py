# SPDX-License-Identifier: Apache-2.0
"""A gain with a factor without a unit leads from an angle to a torque."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms")
angle, torque = cell.svv("angle", unit="rad"), cell.svv("torque", unit="N.m")

spring = gpac.Verb(
    "spring",
    blocks={"stiffness": lib.gain(k=80.0)},
    instantiation_parameters={"angle": "stiffness.u", "torque": "stiffness.y"},
    modes={"stiffness.u": "asynchronous"},
    command_lists={"start": [activate("stiffness", every="1 ms")]},
)
spring.on(fast)(angle, torque)
