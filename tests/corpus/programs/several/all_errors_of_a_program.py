# SPDX-License-Identifier: Apache-2.0
"""Four errors in four statements: all are reported, but no error that only follows from another."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)

y = cell.svv("y", "flot")
wave = gpac.Verb(
    "wave",
    blocks={"generator": lib.signal_generator, "filter": lib.lowpas},
    cells={"raw": ["generator.y", "filter.u"]},
    command_lists={"start": [activate("generator", every="1 ms"), activate("filter")]},
)
tone = gpac.Verb(
    "tone",
    blocks={"generator": lib.signal_generator, "filter": lib.lowpass},
    command_lists={"start": [activate("generater", every="1 ms")]},
)
wave.on(fast)(y)
tone.on(fast)()


def main() -> None:
    for type in ("double", "float"):
        cell.svv("a", type)


main()
