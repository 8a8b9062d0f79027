# SPDX-License-Identifier: Apache-2.0
"""The driver `examples/drivers/io_module.py`, on `canopen`, against a module that the same package simulates behind an adapter of the
test.

The conformance kit runs on it in `make faults` (`tests/faults/io_module.py`): each process that imports `canopen` costs 0.4 s of
processor time.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until
from opengpac.cell import AnalogOutput, DigitalOutput, set_output
from slcan_peer import ANALOG_IN, ANALOG_OUT, INPUTS, OUTPUTS, Adapter

DRIVER = Path(__file__).parents[3] / "examples" / "drivers" / "io_module.py"


@pytest.fixture
def adapter() -> Iterator[Adapter]:
    """Yields an adapter with a module with node number 7."""
    with Adapter(node=7) as made:
        yield made


def test_it_is_short_enough_to_be_read() -> None:
    assert len(DRIVER.read_text().splitlines()) <= 60


def test_it_is_read_commanded_asked_and_lost(adapter: Adapter) -> None:
    told = adapter.module.sdo
    with gpac.System("cell") as cell:
        rtp = cell.processor("rtp0")
        driver = gpac.drivers.python(DRIVER, interface="slcan", channel=adapter.port, node=7, timeout="8 s", age_max="60 s")
        io = rtp.physical_device("io", driver, exchange=rtp.timer("slow", period="10 ms", priority=50))
        told[INPUTS][1].raw, told[ANALOG_IN][1].raw = 0b101, 16384
        until(lambda: tuple(cell.read(io["inputs"])) == (5,), "its inputs are read")
        assert cell.read(io["level"])[0] == pytest.approx(5.0, abs=1e-3)
        assert io.services.serial_number() == 1234
        valve, voltage = DigitalOutput("valve", io["valve"]).enable(), AnalogOutput("voltage", io["voltage"], low=-10, high=10).enable()
        set_output(valve, True)
        set_output(voltage, -2.5)
        until(lambda: (told[OUTPUTS][1].raw, told[ANALOG_OUT][1].raw) == (1, -8192), "its outputs are told")
        valve.disable(), voltage.disable()
        until(lambda: (told[OUTPUTS][1].raw, told[ANALOG_OUT][1].raw) == (0, 0), "they are safe when nobody commands them")
        adapter.is_silent = True
        lost = until(lambda: cell.statistics["physical_devices"]["io"]["lost"], "one that does not answer is lost")
        assert "No SDO response received" in lost
        adapter.is_silent = False
        cell.reset()
        until(lambda: cell.statistics["physical_devices"]["io"]["lost"] is None, "it answers again")
