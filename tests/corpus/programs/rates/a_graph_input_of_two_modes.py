# SPDX-License-Identifier: Apache-2.0
"""A port of a graph covers a synchronous input and an asynchronous one."""

import opengpac as gpac
from opengpac import library as lib

watched = gpac.Graph(
    "watched",
    blocks={"smooth": lib.lowpass, "most": lib.comparator},
    inputs={"u": ["smooth.u", "most.u"]},
    outputs={"y": "smooth.y"},
    modes={"most.u": "asynchronous"},
)
