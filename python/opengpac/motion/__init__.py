# SPDX-License-Identifier: Apache-2.0
"""Motion of joints and arms: `gpac.motion.move_linear(arm, pose)`, `gpac.motion.follow(arm, points, blend=0.05)`."""

from .line import LineRefused, follow_linear, move_linear
from .path import PathRefused, follow
from .payload import carry

__all__ = ["LineRefused", "PathRefused", "carry", "follow", "follow_linear", "move_linear"]
