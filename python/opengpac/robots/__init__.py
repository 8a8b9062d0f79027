# SPDX-License-Identifier: Apache-2.0
"""Arms that are ready to use: `arm = gpac.robots.load("ur5e")`, `arm.enable()`, `gpac.robots.move(arm, goal)`.

Any MJCF file of an arm can be loaded; each actuated joint becomes a logical device.
"""

from .arms import load
from .gripper import Finger, finger_servo, gripper
from .joints import FollowingError, Joint, joint_servo
from .motion import MotionTimeout, Moved, move

__all__ = ["Finger", "FollowingError", "Joint", "MotionTimeout", "Moved", "finger_servo", "gripper", "joint_servo", "load", "move"]
