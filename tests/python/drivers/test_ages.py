# SPDX-License-Identifier: Apache-2.0
"""Ages of readings: as the device reports them, if it does, and growing while no new report arrives."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until

SCANNER = """
from opengpac.driver import NOTHING_NEW, Driver, Option, read


class Scanner(Driver):
    "A scanner that tells something at each tenth exchange, 3 ms after it has taken it."

    says: str = Option("what exchange returns at the third exchange", "")
    distance = read("double", unit="m")

    def open(self):
        self.exchanges = 0

    def exchange(self):
        self.exchanges += 1
        if self.exchanges == 3 and self.says:
            return eval(self.says)
        if self.exchanges % 10 != 1:
            return NOTHING_NEW
        self.distance = float(self.exchanges)
        return 0.003
"""

COUNTER_IN_C = """
#include <opengpac_driver.h>

struct counter { int64_t taken_ns; int reads; opengpac_slot count; };

DRIVER(counter, "Counts its readings, and tells a new count with each fifth.", exchange(worker))

const char *counter_make(struct counter *self, opengpac_host *host) {
    self->count = reads(host, "double", "count", "readings so far", "");
    return OK;
}
const char *counter_read(struct counter *self, int64_t release_ns, uint8_t *readings) {
    if (self->reads++ % 5 == 0) self->taken_ns = release_ns;
    set_number(readings, self->count, self->reads);
    return OK;
}
int64_t counter_taken(struct counter *self) { return self->taken_ns; }
void counter_safe_state(struct counter *self) {}
"""


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("cell", clock="virtual", progress=False) as made:
        yield made


def ages(cell: gpac.System, device: gpac.PhysicalDevice, periods: int) -> list[float]:
    """Returns the age of the readings after each period of 10 ms, in ms."""
    found: list[float] = []
    for _ in range(periods):
        cell.advance("10 ms")
        found.append(round(cell.read(device["age"])[0] * 1e3, 6))
    return found


def scanner(cell: gpac.System, tmp_path: Path, **options: str) -> gpac.PhysicalDevice:
    (tmp_path / "scanner.py").write_text(SCANNER)
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="10 ms", priority=50)
    return rtp.physical_device("scanner", gpac.drivers.python(tmp_path / "scanner.py", **options), exchange=slow)


def test_readings_are_as_old_as_the_device_says_and_grow_older_while_it_says_nothing(cell: gpac.System, tmp_path: Path) -> None:
    found = ages(cell, scanner(cell, tmp_path), 25)
    first = found.index(3.0)
    assert first <= 1
    expected = [3.0 + 10.0 * (n % 10) for n in range(25 - first)]
    assert found[first:] == expected


@pytest.mark.parametrize("says", ["'soon'", "-1.0", "float('nan')", "True", "float('inf')"])
def test_an_age_that_is_none_loses_the_device_with_its_cause(cell: gpac.System, tmp_path: Path, says: str) -> None:
    device = scanner(cell, tmp_path, says=says)
    cell.advance("50 ms")
    lost = cell.statistics["physical_devices"][device.name]["lost"]
    assert "return nothing, opengpac.driver.NOTHING_NEW, or the age of the readings" in lost


@pytest.mark.parametrize(("age_max", "is_lost"), [(None, False), ("150 ms", True)])
def test_a_device_that_tells_nothing_new_is_lost_only_where_an_age_was_asked_for(
    tmp_path: Path, age_max: str | None, is_lost: bool
) -> None:
    silent = SCANNER.replace("% 10 != 1", "> 1")
    (tmp_path / "silent.py").write_text(silent)
    with gpac.System("cell", progress=False) as cell:
        rtp = cell.processor("rtp0")
        # Without a given age, the device may be silent for ten periods: a busy machine may take longer than a tenth of a second.
        driver = gpac.drivers.python(tmp_path / "silent.py", age_max=age_max, **({} if age_max else {"period": "12 s"}))
        device = rtp.physical_device("silent", driver, exchange=rtp.timer("slow", period="10 ms", priority=50))
        if is_lost:
            why = until(lambda: cell.statistics["physical_devices"]["silent"]["lost"], "it is lost")
            assert "more than 150 ms: it answers too slowly, or delivers nothing new" in why
        else:
            until(lambda: cell.read(device["age"])[0] > 1.0, "its readings are old")
            assert cell.statistics["physical_devices"]["silent"]["lost"] is None


def test_a_driver_in_c_says_when_its_machine_took_the_readings(cell: gpac.System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "counter.c").write_text(COUNTER_IN_C)
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="10 ms", priority=50)
    device = rtp.physical_device("counter", gpac.drivers.load(tmp_path / "counter.c")(), exchange=slow)
    found = ages(cell, device, 12)
    first = found.index(0.0)
    assert found[first:] == [10.0 * (n % 5) for n in range(12 - first)]


def test_what_says_nothing_over_a_line_of_text_gets_older(cell: gpac.System) -> None:
    with gpac.drivers.fake.text() as scale:
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        fields = {"weight": {"unit": "kg"}}
        device = rtp.physical_device("scale", gpac.drivers.text(scale.address, reads=["{weight}"], fields=fields), exchange=slow)
        assert ages(cell, device, 3)[1:] == [10.0, 20.0]
        cell.advance("1 s")
        assert cell.read(device["age"])[0] > 1.0
        scale.say("12.5")
        until(lambda: cell.advance("10 ms") or cell.read(device["weight"])[0] == 12.5, "it is heard")
        assert cell.read(device["age"])[0] < 0.05
