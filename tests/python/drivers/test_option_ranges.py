# SPDX-License-Identifier: Apache-2.0
"""Numbers out of range in drivers' options are refused before anything opens, with path, range and the probable intention."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac

HEATER = '''
from opengpac.driver import Driver, Option, read, write


class Heater(Driver):
    """A heater."""

    watts: float = Option("its power", 5.0, unit="W", within=(0, 100))
    settle: float = Option("how long it takes to be there", 0.0, unit="s")
    stages: int = Option("how many", 1, within="[1, 4]")
    heat = write(unit="W")
    level = read(unit="W")

    def open(self):
        raise OSError("it was opened")

    def exchange(self):
        self.level = self.heat
'''


def made(driver: gpac.drivers.Driver) -> None:
    """Creates a device with the driver."""
    with gpac.System("cell", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        rtp.physical_device("device", driver, exchange=rtp.timer("slow", period="10 ms", priority=60))


def refused(driver: gpac.drivers.Driver) -> str:
    """Returns why no device can be created with the driver."""
    with pytest.raises(gpac.Error) as why:
        made(driver)
    return str(why.value)


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        (
            "ur",
            {"host": "192.0.2.1", "speed_max": 180.0},
            "option 'speed_max': it cannot be 180 rad/s: its range is 0.001 rad/s to 10 rad/s",
        ),
        ("ur", {"host": "192.0.2.1", "wait_ns": -1}, "option 'wait_ns': it cannot be -1 ns: its range is 0 ns to 3600 s"),
        (
            "feetech",
            {"port": "/dev/x", "servos": {"elbow": {"id": 300}}},
            "option 'servos.elbow.id': it cannot be 300: its range is 0 to 252",
        ),
        ("feetech", {"port": "/dev/x", "servos": {"a": {"id": 1, "min": 1e9}}}, "option 'servos.a.min': it cannot be 1e9 rad"),
        ("modbus", {"address": "tcp/192.0.2.1", "channels": {"x": {"coil": 70000}}}, "option 'channels.x.coil': it cannot be 70000"),
        ("text", {"address": "tcp/192.0.2.1:1", "reads": ["{x}"], "fields": {"x": {"base": 2}}}, "option 'fields.x.base': it cannot be 2"),
        ("canopen", {"interface": "emulated", "axes": [{"name": "x", "node": 200, "counts": 1}]}, "option 'axes.x.node': it cannot be 200"),
        (
            "ethercat",
            {"interface": "local:x", "axes": [{"name": "x", "counts": 1, "brake": {"bit": 32}}]},
            "option 'axes.x.brake.bit': it cannot be 32",
        ),
        ("loopback", {"parts": ["a"], "initial": [0.0, -1e9]}, "option 'initial': it cannot be -1e9 rad"),
        ("loopback", {"parts": ["a"], "period_ns": 10}, "the driver has no such option"),
        (
            "modbus",
            {"address": "tcp/192.0.2.1", "channels": {"x": {"coil": 1}}, "period_ns": 10},
            "its range is 100 us to 10 s; give 10000000 for 10 ms",
        ),
        (
            "plant_process",
            {"driver": {"kind": "loopback", "options": {"parts": ["a"], "slew": 0}}},
            "option 'slew': it cannot be 0 N.m/s",
        ),
    ],
)
def test_a_number_out_of_its_range_is_refused_with_its_path(kind: str, options: dict[str, Any], said: str) -> None:
    assert said in refused(gpac.drivers.Driver(kind, options))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused_by_its_place(number: float) -> None:
    assert "'options.speed_max'" in refused(gpac.drivers.Driver("ur", {"host": "192.0.2.1", "speed_max": number}))
    axes = [{"name": "x", "node": 1, "counts": number}]
    assert "'options.axes[0].counts'" in refused(gpac.drivers.Driver("canopen", {"interface": "emulated", "axes": axes}))


def test_a_driver_in_python_declares_ranges(tmp_path: Path) -> None:
    file = tmp_path / "heater.py"
    file.write_text(HEATER)
    for options, said in [
        ({"watts": 200.0}, "option 'watts' of driver Heater cannot be 200 W: its range is 0 to 100 W"),
        ({"watts": "2 kW"}, "cannot be 2000 W"),
        ({"settle": -0.5}, "option 'settle' of driver Heater cannot be -0.5 s: its range is at least 0 s"),
        ({"stages": 5}, "option 'stages' of driver Heater cannot be 5: its range is 1 to 4"),
        ({"watts": math.nan}, "must be finite, not nan"),
    ]:
        with pytest.raises(gpac.Error) as why:
            made(gpac.drivers.python(file, **options))
        assert said in str(why.value)
        assert "it was opened" not in str(why.value)
    assert "it was opened" in refused(gpac.drivers.python(file, watts=50.0))
