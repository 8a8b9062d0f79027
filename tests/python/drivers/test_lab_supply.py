# SPDX-License-Identifier: Apache-2.0
"""The driver `examples/drivers/lab_supply.py` against a supply emulated in a few lines here."""

from __future__ import annotations

import socketserver
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import pushing, until

DRIVER = Path(__file__).parents[3] / "examples" / "drivers" / "lab_supply.py"


class Supply(socketserver.ThreadingTCPServer):
    """Supply with a resistor of 10 Ohm at its terminals."""

    allow_reuse_address = True
    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Line)
        self.settings: dict[str, float] = {}
        self.lines: list[Line] = []

    def volts(self) -> float:
        """Returns the voltage at the terminals."""
        wanted = self.settings.get("VOLT", 0.0) if self.settings.get("OUTP") else 0.0
        return min(wanted, 10.0 * self.settings.get("CURR", 0.0))


class Line(socketserver.StreamRequestHandler):
    """Connection of a client to the supply."""

    def handle(self) -> None:
        supply = self.server
        assert isinstance(supply, Supply)
        supply.lines.append(self)
        for line in self.rfile:
            what, _, value = line.decode().strip().partition(" ")
            if value:
                supply.settings[what] = float(value)
            else:
                volts = supply.volts()
                self.wfile.write(f"{volts if 'VOLT' in what else volts / 10.0:g}\n".encode())


@pytest.fixture
def supply() -> Iterator[Supply]:
    """Yields a listening supply."""
    made = Supply()
    serving = threading.Thread(target=made.serve_forever, daemon=True)
    serving.start()
    yield made
    made.shutdown()
    serving.join()
    made.server_close()


def opened(cell: gpac.System, supply: Supply) -> tuple[gpac.PhysicalDevice, gpac.Source]:
    """Returns the supply as a device, and the source that exchanges with it."""
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="2 ms", priority=50)
    driver = gpac.drivers.python(
        DRIVER, host="127.0.0.1", port=supply.server_address[1], current_max="500 mA", timeout="60 s", age_max="20 s"
    )
    return rtp.physical_device("supply", driver, exchange=slow), slow


def test_it_is_commanded_and_measured(supply: Supply) -> None:
    with gpac.System("cell") as cell:
        device, slow = opened(cell, supply)
        until(lambda: supply.settings.get("CURR") == 0.5, "its limit is told")
        hold = pushing.on(slow).asynch(device["target"], u=3.0)
        until(lambda: supply.settings.get("VOLT") == 3.0, "it is told its voltage")
        until(lambda: supply.settings.get("OUTP") == 0.0, "nobody has switched it on")
        hold.halt()
        until(lambda: supply.settings["VOLT"] == 0.0, "what nobody commands is safe")
    until(lambda: not supply.settings["OUTP"], "it is off at the end")


def test_a_connection_that_breaks_loses_the_device_and_it_comes_back(supply: Supply) -> None:
    with gpac.System("cell") as cell:
        device, _ = opened(cell, supply)
        until(lambda: supply.lines, "it is connected")
        supply.lines[-1].connection.shutdown(2)
        lost = until(lambda: cell.statistics["physical_devices"]["supply"]["lost"], "it is lost")
        assert "ConnectionError: the supply at 127.0.0.1 has closed the connection" in lost or "BrokenPipeError" in lost
        device.reopen()
        assert cell.statistics["physical_devices"]["supply"]["lost"] is None
        until(lambda: len(supply.lines) == 2, "it is connected anew")


def test_a_supply_that_is_not_there_cannot_be_opened(supply: Supply) -> None:
    with gpac.System("cell") as cell:
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="2 ms", priority=50)
        driver = gpac.drivers.python(DRIVER, host="127.0.0.1", port=1)
        with pytest.raises(gpac.DeviceFailed, match=r"cannot open device 'supply': driver 'python': ConnectionRefusedError"):
            rtp.physical_device("supply", driver, exchange=slow)
