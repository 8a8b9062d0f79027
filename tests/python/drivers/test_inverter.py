# SPDX-License-Identifier: Apache-2.0
"""The driver `examples/drivers/inverter.py`, on `pymodbus`, against a device of `gpac.drivers.fake`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until
from kit_of_drivers import checked
from opengpac.cell import AnalogOutput, DigitalOutput, set_output
from opengpac.drivers.fake import Modbus

DRIVER = Path(__file__).parents[3] / "examples" / "drivers" / "inverter.py"


@pytest.fixture
def there() -> Iterator[Modbus]:
    """Yields an inverter that turns at 12.5 Hz and draws 3.4 A."""
    with gpac.drivers.fake.modbus() as made:
        for register, value in {0: 0, 1: 0, 16: 0, 17: 1250, 18: 34}.items():
            made.put("holding", register, value)
        yield made


def port(there: Modbus) -> int:
    """Returns the port of the inverter."""
    return int(there.address.rpartition(":")[2])


def test_it_is_commanded_read_and_reset(there: Modbus) -> None:
    with gpac.System("cell") as cell:
        rtp = cell.processor("rtp0")
        driver = gpac.drivers.python(DRIVER, host="127.0.0.1", port=port(there), timeout="3 s", age_max="30 s")
        fan = rtp.physical_device("fan", driver, exchange=rtp.timer("slow", period="10 ms", priority=50))
        until(lambda: tuple(cell.read(fan["frequency"], fan["current"])) == (12.5, 3.4), "it is read")
        run, wanted = DigitalOutput("run", fan["run"]).enable(), AnalogOutput("wanted", fan["wanted"], low=0, high=50).enable()
        set_output(wanted, 20.0)
        set_output(run, True)
        until(lambda: (there.holding[0], there.holding[1]) == (1, 2000), "it is told")
        fan.services.reset_fault()
        there.put("holding", 16, 8)
        until(lambda: cell.read(fan["fault"])[0], "its fault is seen")
        there.silent.add(1)
        lost = until(lambda: cell.statistics["physical_devices"]["fan"]["lost"], "one that does not answer is lost")
        assert "No response received" in lost
        there.silent.clear()
        cell.reset()
        until(lambda: cell.read(fan["frequency"])[0] == 12.5, "it answers again")


def test_a_lost_answer_is_asked_for_again(there: Modbus, monkeypatch: pytest.MonkeyPatch) -> None:
    answers, lost = there._answer, list[bytes]()

    def answer(unit: int, request: bytes) -> bytes | None:
        if len(lost) < 2:
            return lost.append(request)
        return answers(unit, request)

    monkeypatch.setattr(there, "_answer", answer)
    with gpac.System("cell") as cell:
        rtp = cell.processor("rtp0")
        driver = gpac.drivers.python(DRIVER, host="127.0.0.1", port=port(there), timeout="1 s", age_max="30 s")
        fan = rtp.physical_device("fan", driver, exchange=rtp.timer("slow", period="10 ms", priority=50))
        until(lambda: cell.read(fan["frequency"]) == (12.5,), "it is read")
        assert len(lost) == 2 and fan.counters["unanswered"] == 0


def test_it_passes_the_kit(there: Modbus) -> None:
    assert len(DRIVER.read_text().splitlines()) <= 60
    assert ", 0 failed, " in checked(str(DRIVER), "host=127.0.0.1", f"port={port(there)}")
