# SPDX-License-Identifier: Apache-2.0
"""A press whose one joint slides, for the page's tests: its time is virtual and follows the clock on the wall."""

import time

import opengpac as gpac
from opengpac import motion

STEP_S = 0.02

cell = gpac.System("press", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
rtp.timer("slow", period="20 ms", priority=60)
device = rtp.physical_device("press", gpac.drivers.loopback("ram"), exchange=fast)
sliding = {"N.m": "N", "rad": "m"}
ram = gpac.robots.Joint("ram", drive=device["ram"], on=fast, units=sliding, position_min=0.0, position_max="400 mm", max_speed="0.3 m/s")
ram.enable()
motion.move_velocity.asynch(ram, "1 mm/s")
while True:
    cell.advance(STEP_S)
    time.sleep(STEP_S)
