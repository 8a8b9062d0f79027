# SPDX-License-Identifier: Apache-2.0
"""A system that has had a code module in two versions; `run.mcap` in the folder of the argument is a run with the first one."""

import sys
from pathlib import Path

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

SOURCE = (Path(__file__).parent / "count.c").read_text()
FOLDER = Path(sys.argv[1])


def download(system: gpac.System, text: str):
    """The module from a source with this text."""
    source = FOLDER / "count.c"
    source.write_text(text)
    return system.download(source)


with gpac.System("bench", clock="virtual") as cell, cell.record(FOLDER / "run.mcap", replay=True):
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    counts = gpac.Verb(
        "counts",
        blocks={"count": download(cell, SOURCE).count, "wave": lib.signal_generator(shape=1, frequency=50.0, amplitude=0.5)},
        instantiation_parameters={"n": "count.n", "y": "wave.y"},
        command_lists={"start": [activate("count", every="1 ms"), activate("wave", every="1 ms")]},
    )
    run = counts.on(fast).asynch(cell.svv("bench.n", unit="V"), cell.svv("bench.y"))
    cell.advance("2 s")
    run.halt()

cell = gpac.System("cell", clock="virtual")
download(cell, SOURCE)
download(cell, SOURCE.replace("self->n += 1;", "self->n += self->n == 999 ? 2 : 1;"))
