# SPDX-License-Identifier: Apache-2.0
"""Signals of a cell: inputs and outputs as logical devices, and verbs that set, pulse and wait for them.

The other services of a cell belong to the system: `cell.pause()`, `cell.alarms`, `cell.mode`, `cell.emergency_stop_input(...)`,
`cell.save(...)`. Taught points are `gpac.Points`.
"""

from .signals import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput
from .verbs import InputTimeout, pulse, set_output, wait_for_input

__all__ = [
    "AnalogInput", "AnalogOutput", "DigitalInput", "DigitalOutput", "InputTimeout", "pulse", "set_output", "wait_for_input",
]  # fmt: skip
