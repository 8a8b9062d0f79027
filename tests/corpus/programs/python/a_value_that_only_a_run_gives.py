# SPDX-License-Identifier: Apache-2.0
"""A program uses a value that exists only in a run."""

import opengpac as gpac
from opengpac import activate, library


def mean(level: gpac.SVV[float]) -> float:
    """Divides by a value that is zero while nothing runs."""
    return 1.0 / level.value


with gpac.System("cell", clock="virtual") as cell:
    fast = cell.processor("rtp0").timer("fast", period="1 ms")
    for name in ("a", "b"):
        level = cell.svv(name)
        print(mean(level))
    wave = gpac.Verb(
        "wave",
        blocks={"wave": library.noise},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms")]},
    )
    wave.on(fast)(cell.svv("other", "float"))
