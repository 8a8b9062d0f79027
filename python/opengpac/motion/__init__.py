# SPDX-License-Identifier: Apache-2.0
"""Motions of a joint or a group of joints: `gpac.motion.move_absolute(arm, goal)`, `stop(arm)`, `home(joint, switch)`.

The words are those of PLCopen Motion Control. Each is a verb: it may be started with `.asynch(...)`, halted, given a `time_limit`,
composed with others. All begin from where the joints are commanded to be and how fast they move there, and when they are
halted or their time is up they slow down within the limits first. `arm.override` and `cell.override` scale their speed.
"""

from .coupled import gear
from .home import Homed, HomingFailed, home, home_here
from .moves import Moved, MoveTimeout, move_absolute, move_relative
from .velocity import LimitReached, Stopped, jog, move_velocity, stop

__all__ = [
    "Homed", "HomingFailed", "LimitReached", "MoveTimeout", "Moved", "Stopped", "gear", "home", "home_here", "jog", "move_absolute",
    "move_relative", "move_velocity", "stop",
]  # fmt: skip
