# SPDX-License-Identifier: Apache-2.0
"""Drivers of physical devices, opened by `rtp.physical_device(name, driver, exchange=source)`."""

import importlib
from typing import TYPE_CHECKING, Any

from .canopen import canopen
from .catalog import Found, Manual, Manuals, list, manuals, scan, show
from .driver import UNLIMITED as UNLIMITED
from .driver import Driver
from .ethercat import ethercat
from .in_python import python
from .loading import Drivers, load
from .modbus import modbus, modbus_server
from .servos import dynamixel, feetech
from .simulated import loopback, mujoco, plant_process, scripted
from .text import text
from .ur import ur

if TYPE_CHECKING:
    from ..fmi.device import fmu
    from . import fake as fake

__all__ = [
    "Driver",
    "Drivers",
    "Found",
    "Manual",
    "Manuals",
    "canopen",
    "dynamixel",
    "ethercat",
    "fake",
    "feetech",
    "fmu",
    "list",
    "load",
    "loopback",
    "manuals",
    "modbus",
    "modbus_server",
    "mujoco",
    "plant_process",
    "python",
    "scan",
    "scripted",
    "show",
    "text",
    "ur",
]


def __getattr__(name: str) -> Any:
    """Imports FMUs and test counterparts on first use, since a program that drives a machine does not need them."""
    if name == "fake":
        return importlib.import_module(".fake", __name__)
    if name == "fmu":
        return importlib.import_module("..fmi.device", __name__).fmu
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
