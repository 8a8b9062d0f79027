# SPDX-License-Identifier: Apache-2.0
"""The example with an operator's panel, for the page's tests: its time is virtual and follows the clock on the wall."""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "examples" / "operator_panel"))

import program

STEP_S = 0.02

cell = program.make("virtual")
while True:
    cell.advance(STEP_S)
    time.sleep(STEP_S)
