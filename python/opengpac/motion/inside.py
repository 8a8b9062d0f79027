# SPDX-License-Identifier: Apache-2.0
"""Moves joints that are outside their range back into it."""

from __future__ import annotations

import numpy as np

from ..devices.groups import Group
from ..robots.generators import Values
from ..robots.joints import Joint
from .moves import Moved, move_absolute


def return_to_range(arm: Group[Joint] | Joint, /, speed: Values = "10 %") -> Moved | None:
    """Moves each joint whose commanded position is outside its range to the nearer limit of the range; other joints do not move. Returns
    None if all joints are within their ranges.

    speed: rad/s (m/s) or a fraction of `max_speed`. `enable()` logs the joints that are outside.
    """
    joints = [arm] if isinstance(arm, Joint) else list(arm)
    wanted = [float(joint.commanded.value) for joint in joints]
    ends = [float(np.clip(q, joint.position_min, joint.position_max)) for joint, q in zip(joints, wanted, strict=True)]
    outside = [(joint, end) for joint, q, end in zip(joints, wanted, ends, strict=True) if q != end]
    if not outside:
        return None
    return move_absolute(Group(arm.name, *(joint for joint, _ in outside)), [end for _, end in outside], speed=speed)
