# SPDX-License-Identifier: Apache-2.0
import opengpac as gpac
from opengpac import activate, library, on

arm = gpac.robots.load("ur5e").enable()
swing = gpac.Verb("swing",
    blocks={"wave": library.signal_generator(shape=1), "clock": library.time_limit},
    objects={"joint": gpac.robots.Joint},
    instantiation_parameters={"joint.commanded": "wave.y"},
    input_parameters={"amplitude": "wave.amplitude", "frequency": "wave.frequency", "seconds": "clock.limit"},
    output_values={"commanded": "wave.y"},
    command_lists={"start": [activate("wave", every="20 ms"), activate("clock", every="20 ms")]},
    conditions={"over": on("clock.expired", returns=["commanded"])})
print(swing(arm.wrist_3, amplitude=0.3, frequency=0.5, seconds=4.5))
