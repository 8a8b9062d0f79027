# SPDX-License-Identifier: Apache-2.0
"""Ready-made arms: `arm = gpac.robots.load("ur5e")`, `arm.enable()`, `gpac.robots.move(arm, goal)`.

Loads any MJCF or URDF file of an arm, and the arms that `opengpac robots` lists by name; each actuated joint becomes a logical
device.
"""

from .arm import Arm
from .arms import load
from .dynamics import Dynamics, Link
from .gripper import Finger, finger_follower, finger_servo, gripper
from .joints import Joint
from .kinematics import Axis, Kinematics
from .motion import MotionTimeout, Moved, move
from .payload import Payload
from .payload_identification import IdentifiedPayload, identify_payload
from .servos import FollowingError, ServoUnstable, joint_decoupled_servo, joint_follower, joint_servo
from .tool_frame import TouchedTool, tool_by_touching
from .urdf import Interfaces

__all__ = [
    "Arm", "Axis", "Dynamics", "Finger", "FollowingError", "IdentifiedPayload", "Interfaces", "Joint", "Kinematics", "Link",
    "MotionTimeout", "Moved", "Payload", "ServoUnstable", "TouchedTool", "finger_follower", "finger_servo", "gripper", "identify_payload",
    "joint_decoupled_servo", "joint_follower", "joint_servo", "load", "move", "tool_by_touching",
]  # fmt: skip
