# SPDX-License-Identifier: Apache-2.0
"""Two parts have an input of the same name with different defaults, and a transition leads to a part that does not exist."""

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib

cell = gpac.System("cell", clock="virtual")


def part(name: str, frequency: float) -> gpac.Verb:
    return gpac.Verb(
        name,
        blocks={"wave": lib.signal_generator, "guard": lib.force_guard},
        cells={"force": ["wave.y", "guard.force"]},
        input_parameters={"frequency": gpac.input("wave.frequency", default=frequency)},
        command_lists={"start": [activate("wave", every="1 ms"), activate("guard", every="1 ms")]},
        conditions={"above": on("guard.above", returns=[])},
    )


both = gpac.compose("both", {"slow": part("slow", 1.0), "quick": part("quick", 5.0)}, transitions={("slow", "above"): "quikc"})
