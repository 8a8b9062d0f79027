# SPDX-License-Identifier: Apache-2.0
"""A condition returns a value, but continues to another list from every list."""

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib

swinging = gpac.Verb(
    "swinging",
    blocks={"wave": lib.signal_generator, "edge": lib.comparator},
    cells={"u": ["wave.y", "edge.u"]},
    output_values={"height": "wave.y"},
    command_lists={
        "up": [activate("wave", every="1 ms"), activate("edge")],
        "down": [activate("wave", every="1 ms"), activate("edge")],
    },
    initial="up",
    conditions={"rose": on("edge.rose", returns=["height"])},
    transitions={("up", "rose"): "down", ("down", "rose"): "up"},
)
