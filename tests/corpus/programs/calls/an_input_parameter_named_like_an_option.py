# SPDX-License-Identifier: Apache-2.0
"""An input parameter has the name of an option common to all calls."""

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

waving = gpac.Verb(
    "waving",
    blocks={"wave": lib.signal_generator},
    input_parameters={"time_limit": "wave.amplitude"},
    command_lists={"start": [activate("wave", every="1 ms")]},
)
