# SPDX-License-Identifier: Apache-2.0
"""Drivers in Python: a class with options and channels, whose `exchange` runs in a separate process.

    from opengpac.driver import Driver, Option, read, write

    class Thermometer(Driver):
        "A thermometer with a heater, on a serial line."

        port: str = Option("the serial port")
        temperature = read("double", unit="K")
        heater = write("double", unit="W", safe=0.0)
        damaged = counter("answers with a wrong checksum")

        def open(self): ...
        def exchange(self): ...
        def safe_state(self): ...
        def close(self): ...

        @classmethod
        def scan(cls, **options): ...

        @service
        def calibrate(self, at: float = Option("the actual temperature", unit="K")) -> None:
            "Calibrates the current reading to this temperature."

Pass `gpac.drivers.python("thermometer.py", port="/dev/ttyS0", period="10 ms")` to `rtp.physical_device`. The source that exchanges
with the device never waits for the process: it takes the latest readings, whose age is the channel `age`.
"""

from .base import Driver
from .declarations import Option, counter, part, read, service, write
from .members import NOTHING_NEW, Channel, Counter, NothingNew, Part, PartValues, Service

__all__ = [
    "NOTHING_NEW", "Channel", "Counter", "Driver", "NothingNew", "Option", "Part", "PartValues", "Service", "counter", "part", "read",
    "service", "write",
]  # fmt: skip
