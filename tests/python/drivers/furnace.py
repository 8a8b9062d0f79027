# SPDX-License-Identifier: Apache-2.0
"""A driver in Python for tests: it logs its events, and fails on command."""

from __future__ import annotations

import math
import os
import re
import time
from pathlib import Path

from opengpac.driver import Driver, Option, counter, read, service, write


class Furnace(Driver):
    """A furnace that is as warm as its heater says."""

    folder: str = Option("where it writes down what happens to it")
    ambient: float = Option("the temperature without heat", 20.0, unit="K")
    levels: int = Option("how many", 3)

    temperature = read("double", unit="K")
    pid = read("int32_t", doc="of its process")
    zones = read("float[3]")
    heater = write("double", unit="W", safe=0.0)
    exchanges = counter("exchanges so far")
    drafts = counter("times that its door was opened")

    def open(self) -> None:
        self.tell("open")
        self.pid = os.getpid()

    def exchange(self) -> None:
        for name in ("raises", "hangs", "pauses", "lingers", "lies"):
            if (Path(self.folder) / name).exists():
                getattr(self, name)()
        if not math.isfinite(self.heater):
            raise ValueError(f"its heater is told {self.heater} W")
        self.exchanges += 1
        self.temperature = self.ambient + self.heater
        self.zones = [self.temperature] * 3

    @service
    def calibrate(self, at: float = Option("the temperature that it has without heat", unit="K"), often: int = 1) -> float:
        """Takes a temperature for that without heat."""
        self.ambient = at
        self.drafts += often
        return self.ambient

    @service
    def label(self, text: str = Option("what stands on it", "none")) -> None:
        """Logs a label."""
        if text == "forbidden":
            raise ValueError("nobody may call it that")
        self.tell(f"label {text}")

    @service(moves=True)
    def open_door(self) -> None:
        """Opens its door by a motor."""
        self.tell("door")

    @service
    def lie(self) -> int:
        """Returns a value of an undeclared type."""
        return "seven"  # type: ignore[return-value]

    def raises(self) -> None:
        raise ValueError("its door is open")

    def hangs(self) -> None:
        time.sleep(3600.0)

    def pauses(self) -> None:
        """Waits as long as it was told."""
        (Path(self.folder) / "pausing").touch()
        while (Path(self.folder) / "pauses").exists():
            time.sleep(0.001)

    def lingers(self) -> None:
        """Delays like a slow device: until another process waits for it or has opened the device nevertheless."""
        folder = Path(self.folder)
        (folder / "lingers").unlink()
        (folder / "lingering").touch()
        signs = re.compile(rf"@opengpac-driver-\S*-{os.getpid()}-\d+$", re.MULTILINE)
        # A connection that has not been accepted shows the name of the socket that it requested.
        while len(signs.findall(Path("/proc/net/unix").read_text())) < 2 and (folder / "told").read_text().count("open") < 2:
            time.sleep(0.01)

    def lies(self) -> None:
        self.zones = "warm"
        raise TypeError(f"zones are {self.zones}")

    def safe_state(self) -> None:
        self.tell(f"safe {self.heater:g}")

    def close(self) -> None:
        self.tell("close")

    def tell(self, what: str) -> None:
        with (Path(self.folder) / "told").open("a") as file:
            file.write(f"{what}\n")
