# SPDX-License-Identifier: Apache-2.0
"""64 SVVs, each stored a thousand times a second, for the studio's scope: `opengpac studio studio/tests/channels.py`.

Sines of different frequencies, in V; the last one counts how often all of them were stored. The number of a value does not say that: a
release that is skipped has a number too, and stores nothing. The instance `waves` is created, and started by whoever counts: then nobody
has missed its first values.
"""

from pathlib import Path

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

CHANNELS = 64

cell = gpac.System("channels")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
svvs = [cell.svv(f"bank.c{i:02}", "double", unit="V") for i in range(CHANNELS)]
blocks = {f"wave{i:02}": lib.signal_generator(shape=1, frequency=0.5 + 0.25 * i, phase=i / CHANNELS) for i in range(CHANNELS - 1)}
counted = cell.download(str(Path(__file__).parent / "count.c"))
waves = gpac.Verb(
    "waves",
    blocks=blocks | {"count": counted.count},
    instantiation_parameters={f"c{i:02}": f"wave{i:02}.y" for i in range(CHANNELS - 1)} | {f"c{CHANNELS - 1}": "count.n"},
    command_lists={"start": [activate(label, every="1 ms") for label in [*blocks, "count"]]},
)
instance = waves.on(fast).new_instance(*svvs)
