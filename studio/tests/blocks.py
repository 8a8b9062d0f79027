# SPDX-License-Identifier: Apache-2.0
"""One verb of 200 blocks: 20 sines, each amplified nine times. `opengpac studio studio/tests/blocks.py` serves it.

Its time is virtual and follows the clock on the wall, as that of `program.py`.
"""

import time

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

ROWS, GAINS = 20, 9
STEP_S = 0.02

sines = {f"sine{row:02}": lib.signal_generator(shape=1, amplitude=0.5, frequency=0.2 + 0.01 * row) for row in range(ROWS)}
gains, cells = {}, {}
for row in range(ROWS):
    before = f"sine{row:02}"
    for gain in range(GAINS):
        label = f"gain{row:02}_{gain}"
        gains[label] = lib.gain(k=1.1)
        cells[f"value{row:02}_{gain}"] = [f"{before}.y", f"{label}.u"]
        before = label

many = gpac.Verb(
    "many",
    blocks=sines | gains,
    cells=cells,
    command_lists={"start": [*(activate(label, every="20 ms") for label in sines), *(activate(label) for label in gains)]},
)

cell = gpac.System("blocks", clock="virtual")
slow = cell.processor("rtp0").timer("slow", period="20 ms", priority=60)
many.on(slow).asynch()

while True:
    cell.advance(STEP_S)
    time.sleep(STEP_S)
