# SPDX-License-Identifier: Apache-2.0
"""A graph sets a block's constant in another dimension."""

import opengpac as gpac
from opengpac import library as lib

wave = gpac.Graph("wave", blocks={"source": lib.signal_generator(frequency="50 rad")}, outputs={"y": "source.y"})
