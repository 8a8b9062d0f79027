# SPDX-License-Identifier: Apache-2.0
"""Motions of a joint, a group of joints, and an arm: `gpac.motion.move_absolute(arm, goal)`, `stop(arm)`, `move_linear(arm, pose)`.

The names are those of PLCopen Motion Control. Each motion is a verb: it can be started with `.asynch(...)`, halted, limited by
`time_limit`, and composed with others. All motions start from the commanded position, speed and acceleration of the joints (lines and
paths brake first); when halted or at their time limit they first slow down within the limits. `arm.override` and `cell.override`
scale their speed.
"""

from ..errors import TimeLost
from .arc import ArcRefused, move_circular
from .coupled import gear
from .home import Homed, HomingFailed, home, home_here
from .inside import return_to_range
from .line import LineRefused, follow_linear, follow_linear_long, move_linear
from .moves import Moved, MoveTimeout, move_absolute, move_relative
from .path import PathRefused, follow, follow_long
from .payload import carry
from .queue import MoveQueue
from .queue_rows import at
from .queue_verb import MoveEnd, MoveRefused, QueueReport, move_queue, move_queue_switching
from .tables import speeds
from .tool_jog import JogBlocked, jog_linear
from .velocity import LimitReached, Stopped, jog, move_velocity, stop

__all__ = [
    "ArcRefused", "Homed", "HomingFailed", "JogBlocked", "LimitReached", "LineRefused", "MoveEnd", "MoveQueue", "MoveRefused",
    "MoveTimeout", "Moved", "PathRefused", "QueueReport", "Stopped", "TimeLost", "at", "carry", "follow", "follow_linear",
    "follow_linear_long", "follow_long", "gear", "home", "home_here", "jog", "jog_linear", "move_absolute", "move_circular",
    "move_linear", "move_queue", "move_queue_switching", "move_relative", "move_velocity", "return_to_range", "speeds", "stop",
]  # fmt: skip
