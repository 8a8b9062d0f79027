# SPDX-License-Identifier: Apache-2.0
"""The scan for devices runs where the system is: in this process, or on the host of a daemon."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from daemons import Daemon
from opengpac import _native
from opengpac.cli import main


@pytest.fixture
def url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Yields the address of a daemon; in this process scanning is impossible."""

    def nobody(*_: Any) -> str:
        raise AssertionError("this host has looked")

    monkeypatch.setattr(_native, "scan", nobody)
    daemon = Daemon(tmp_path)
    yield daemon.url
    daemon.stop()


def test_a_daemon_finds_what_hangs_on_its_host(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    with gpac.drivers.fake.modbus(units=[3, 17], serial=True) as line:
        words = ["devices", "scan", "--on", url, "modbus", "--address", line.address, "--unit", "17", "--answer", "30 s"]
        assert main(words) == 0, capsys.readouterr().err
        told = capsys.readouterr().out
        assert "1 device found" in told and "OpenGPAC fake 1" in told
        with gpac.connect(url) as cell:
            (found,) = cell.scan_devices("modbus", address=line.address, unit=3, answer_ns=30_000_000_000)
            assert found["driver"] == "modbus" and found["options"] == {"address": line.address, "unit": 3}
            assert main(words) == 0, "a program that commands is not disturbed"


def test_what_a_daemon_refuses_is_told(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices", "scan", "--on", url, "loopback"]) == 1
    assert "driver 'loopback'" in (told := capsys.readouterr().err) and "cannot search for devices" in told
    assert main(["devices", "scan", "--on", url, "dynamixel", "--port", "/dev/none", "--baud", "57600"]) == 1
    assert "driver 'dynamixel' did not carry out a search: /dev/none at 57600 baud" in capsys.readouterr().err
    assert main(["devices", "scan", "--on", "unix:///nowhere/cell.sock", "dynamixel"]) == 1
    assert "/nowhere/cell.sock" in capsys.readouterr().err
    assert main(["devices", "scan", "--on", "nobody", "dynamixel"]) == 1
    assert "no daemon named 'nobody'" in capsys.readouterr().err


def test_a_system_of_this_process_looks_here() -> None:
    with gpac.drivers.fake.modbus() as device, gpac.System("here", clock="virtual") as cell:
        where = {"address": device.address, "answer_ns": 30_000_000_000}
        found = cell.scan_devices("modbus", **where)
        assert found == gpac.drivers.scan("modbus", **where) and len(found) == 1
        with pytest.raises(gpac.UnknownName, match="did you mean 'feetech'"):
            cell.scan_devices("fetech")
