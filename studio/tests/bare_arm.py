# SPDX-License-Identifier: Apache-2.0
"""An arm and nothing else, as somebody begins: the page has something to press. Its time is virtual and follows the clock on the wall."""

import time

import opengpac as gpac

STEP_S = 0.02

arm = gpac.robots.load("ur5e", clock="virtual").enable()
while True:
    arm.system.advance(STEP_S)
    time.sleep(STEP_S)
