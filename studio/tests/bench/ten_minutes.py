# SPDX-License-Identifier: Apache-2.0
"""Makes a recording of 64 channels at 1 kHz in the folder of the first argument, `long.mcap`; of so many seconds as the second says.

Each channel is a sine of its own frequency; a verb that changes its side twice a second gives the log its conditions.
"""

import sys
from pathlib import Path

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib

CHANNELS = 64

BLINK = gpac.Verb(
    "blink",
    blocks={"wave": lib.signal_generator(frequency=1.0), "side": lib.comparator},
    cells={"y": ["wave.y", "side.u"]},
    modes={"side.u": "asynchronous"},
    command_lists={name: [activate("wave", every="20 ms"), activate("side", every="20 ms")] for name in ("low", "high")},
    initial="low",
    conditions={"rose": on("side.rose", during="low"), "fell": on("side.fell", during="high")},
    transitions={("low", "rose"): "high", ("high", "fell"): "low"},
)
names = [f"c{number:02}" for number in range(CHANNELS)]
SIGNALS = gpac.Verb(
    "signals",
    blocks={name: lib.signal_generator(frequency=0.1 * (number + 1)) for number, name in enumerate(names)},
    instantiation_parameters={f"at_{name}": [f"{name}.y"] for name in names},
    command_lists={"all": [activate(name, every="1 ms") for name in names]},
    initial="all",
)

path, seconds = Path(sys.argv[1]) / "long.mcap", int(sys.argv[2])
with gpac.System("long", clock="virtual") as cell:
    rtp = cell.processor("rtp0")
    fast, slow = rtp.timer("fast", period="1 ms", priority=80), rtp.timer("slow", period="20 ms", priority=60)
    svvs = [cell.svv(f"signal.{name}", float) for name in names]
    with cell.record(path, cells=True):
        blink = BLINK.on(slow).asynch()
        signals = SIGNALS.on(fast).asynch(*svvs)
        for _ in range(seconds):
            cell.advance("1 s")
        signals.halt()
        blink.halt()
print(f"{path}: {path.stat().st_size / 1e6:.0f} MB")
