# SPDX-License-Identifier: Apache-2.0
"""The drivers of OpenGPAC whose counterparts are written in Python pass the conformance kit.

The others are in `crates/drivers/tests/conformance/ours.rs`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import opengpac as gpac
from opengpac.drivers import conformance
from opengpac.drivers.driver import Driver

fake = gpac.drivers.fake
Counterpart = Callable[[], AbstractContextManager[Driver]]


@contextmanager
def ur() -> Iterator[Driver]:
    with fake.ur(lockstep=False) as robot:
        yield robot.driver(silence="60 s", timeout="60 s")


@contextmanager
def feetech() -> Iterator[Driver]:
    with fake.servos("feetech", [1, 2]) as bus:
        yield gpac.drivers.feetech(bus.port, {"a": {"id": 1}, "b": {"id": 2}}, baud=1_000_000, latency="60 s", echo=False)


@contextmanager
def dynamixel() -> Iterator[Driver]:
    with fake.servos("dynamixel", [1, 2]) as bus:
        yield gpac.drivers.dynamixel(bus.port, {"a": {"id": 1}, "b": {"id": 2}}, baud=1_000_000, latency="60 s", echo=False)


@contextmanager
def python() -> Iterator[Driver]:
    with TemporaryDirectory() as folder:
        yield gpac.drivers.python(Path(__file__).parent / "furnace.py", folder=folder, period="1 ms", age_max="60 s")


@pytest.mark.parametrize("counterpart", [ur, feetech, dynamixel, python], ids=lambda counterpart: counterpart.__name__)
def test_it_passes_the_kit(counterpart: Counterpart, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with counterpart() as driver:
        report = conformance.check(driver, exchanges=500)
    assert report["passed"], report["text"]
