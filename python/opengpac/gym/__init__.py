# SPDX-License-Identifier: Apache-2.0
"""Gymnasium environments on the virtual clock: episodes of a whole system, with its servos and their limits, many times faster than real
time.

`Environment` sets up a system once; `reset` begins an episode with everything installed in it. `side_by_side` runs several in one
process. Requires the package gymnasium: `pip install 'opengpac[gym]'`.
"""

from ..errors import DefinitionError, refuse

try:
    from .environment import Environment, side_by_side
    from .task import Task
    from .values import Values
except ModuleNotFoundError as missing:
    if missing.name != "gymnasium":
        raise
    refuse(DefinitionError, "gpac.gym needs the package gymnasium, which is not installed", "run pip install 'opengpac[gym]'")

__all__ = ["Environment", "Task", "Values", "side_by_side"]
