# SPDX-License-Identifier: Apache-2.0
"""Test counterparts of drivers, which need no machine: each behaves like its machine, and can be made to fail.

A counterpart is started and stopped by a `with` statement.
"""

from .arm import HOME
from .canopen import CanOpenBus, canopen
from .ethercat import EtherCatSegment, ethercat
from .modbus import Modbus, Tables, modbus
from .servos import FakeServo, FakeServos, servos
from .text import Text, text
from .ur import LEAP_MAX, ur

__all__ = [
    "HOME", "LEAP_MAX", "CanOpenBus", "EtherCatSegment", "FakeServo", "FakeServos", "Modbus", "Tables", "Text", "canopen", "ethercat",
    "modbus", "servos", "text", "ur",
]  # fmt: skip
