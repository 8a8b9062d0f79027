# SPDX-License-Identifier: Apache-2.0
"""Inputs and outputs of a cell; a program holds one of the outputs. Time is virtual and follows the clock on the wall."""

import time

import opengpac as gpac
from opengpac.cell import AnalogOutput, DigitalInput, DigitalOutput, pulse

STEP_S = 0.02

cell = gpac.System("bench", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
io = cell.processor("rtp0").physical_device(
    "io",
    gpac.drivers.scripted(
        [
            {"name": "part", "direction": "read", "type": "bool"},
            {"name": "valve", "direction": "write", "type": "bool"},
            {"name": "lamp", "direction": "write", "type": "bool"},
            {"name": "flow", "direction": "write", "type": "double", "unit": "l/min"},
        ],
        [{"at_ns": 0, "values": {"part": True}}],
    ),
    exchange=fast,
)
devices = [
    DigitalInput("part", io["part"]),
    DigitalOutput("valve", io["valve"]),
    DigitalOutput("lamp", io["lamp"]),
    AnalogOutput("flow", io["flow"], low=0.0, high=20.0),
]
for device in devices:
    device.enable()
pulse.asynch(devices[2], width="10000 s")

while True:
    cell.advance(STEP_S)
    time.sleep(STEP_S)
