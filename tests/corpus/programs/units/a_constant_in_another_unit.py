# SPDX-License-Identifier: Apache-2.0
"""A graph gives a block a constant of another dimension."""

import opengpac as gpac
from opengpac import library as lib

wave = gpac.Graph("wave", blocks={"source": lib.signal_generator(frequency="50 rad")}, outputs={"y": "source.y"})
