# SPDX-License-Identifier: Apache-2.0
"""A system without processors, devices, verbs and SVVs, as a program begins: each view of the page says what would be there."""

import time

import opengpac as gpac

cell = gpac.System("empty", clock="virtual")
while True:
    time.sleep(0.1)
