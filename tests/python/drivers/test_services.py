# SPDX-License-Identifier: Apache-2.0
"""Services and counters of drivers, wherever the driver is open."""

from __future__ import annotations

import contextlib
import inspect
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until
from daemons import Daemon
from opengpac import _native
from opengpac.devices.physical import PhysicalDevice

PLACES = ("virtual", "threads", "process", "daemon")


@pytest.fixture(params=PLACES)
def drives(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PhysicalDevice]:
    """Yields a loopback device with a part `x`: in this process, in a process of its own, on a daemon."""
    if request.param == "daemon":
        daemon = Daemon(tmp_path, "monotonic")
        with gpac.connect(daemon.url, name="tests") as cell:
            yield opened(cell)
        daemon.stop()
        return
    with gpac.System("cell", clock="virtual" if request.param == "virtual" else "monotonic") as cell:
        yield opened(cell, process=request.param == "process")


def opened(cell: gpac.System, process: bool = False) -> PhysicalDevice:
    """Returns the device, exchanged every 2 ms."""
    rtp = cell.processor("rtp0", process=process)
    return rtp.physical_device("drives", gpac.drivers.loopback("x"), exchange=rtp.timer("fast", period="2 ms", priority=50))


def passes(cell: gpac.System) -> None:
    """Advances time, if the clock permits it."""
    # A clock in real time cannot be advanced.
    with contextlib.suppress(gpac.Error):
        cell.advance("10 ms")


def test_a_service_is_a_method(drives: PhysicalDevice) -> None:
    cell, x = drives.system, drives["x"].position
    assert drives.services.place(part="x", position=0.5) is None

    def is_there() -> bool:
        passes(cell)
        return cell.read(x)[0] == 0.5

    until(is_there, "the part is where the service has put it")
    assert drives.services["hold"]("20 ms") == pytest.approx(0.02)


def test_a_service_says_what_it_is(drives: PhysicalDevice) -> None:
    place = drives.services.place
    assert str(inspect.signature(place)) == "(part: str, position: float | None = None) -> None"
    assert (
        inspect.getdoc(place) == "Moves a part to a position at once.\n\npart: name of the part.\n"
        "position: its position from the next reading on, rad; default: 0."
    )
    assert repr(drives.services) == "services of drives: place, hold"
    assert "hold(seconds: float) -> float" in str(drives.services)
    assert {"place", "hold"} <= {*dir(drives.services)}


def test_what_is_wrong_with_a_service_is_said(drives: PhysicalDevice) -> None:
    with pytest.raises(gpac.UnknownName, match=r"has no service 'plce'.*did you mean 'place'"):
        drives.services.plce(part="x")
    with pytest.raises(gpac.CallError, match="argument 'prt': the service has no such argument; did you mean 'part'"):
        drives.services.place(prt="x")
    with pytest.raises(gpac.CallError, match="argument 'part': it is missing; give a string: name of the part"):
        drives.services.place()
    with pytest.raises(gpac.CallError, match="takes 1 arguments, not 2"):
        drives.services.hold(1, 2)
    with pytest.raises(gpac.DeviceFailed, match="did not carry out service 'place': there is no part 'y', only x"):
        drives.services.place("y")
    with pytest.raises(_native.Refused, match="has no service 'plce'"):
        drives.system._alive().device_service("drives", "plce")
    with pytest.raises(_native.Refused, match="physical device"):
        drives.system._alive().device_service("driver", "place")


def test_a_service_that_lasts_holds_up_no_stop(drives: PhysicalDevice) -> None:
    cell, ended = drives.system, []

    def hold() -> None:
        # The system is closed while the service waits.
        with contextlib.suppress(gpac.Error):
            ended.append(drives.services.hold(60))

    threading.Thread(target=hold, daemon=True).start()
    # Called in parallel, on the same device.
    assert drives.services.hold(0) == 0
    cell.emergency_stop("a test")
    assert cell.statistics["emergency"] and not ended
    cell.reset()


def test_a_driver_counts(drives: PhysicalDevice) -> None:
    cell = drives.system

    def counted() -> int:
        passes(cell)
        return drives.counters.get("readings", 0)

    until(lambda: counted() > 3, "readings are counted")
    assert cell.statistics["physical_devices"]["drives"]["counters"]["readings"] > 3
    assert "readings" in str(cell.statistics.counters())
    shown = repr(drives._table())
    assert "safe state: each output carries its safe value, by driver" in shown
    assert "number of readings" in shown


def test_a_device_that_is_opened_again_has_the_services_of_its_new_driver() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="2 ms", priority=50)
        drives = rtp.physical_device("drives", gpac.drivers.loopback("x", fail_at="20 ms"), exchange=fast)
        cell.advance("50 ms")
        assert cell.statistics["physical_devices"]["drives"]["lost"]
        counted = drives.counters["readings"]
        drives.reopen()
        cell.advance("10 ms")
        assert 0 < drives.counters["readings"] < counted
        drives.services.place("x", 0.25)
        cell.advance("2 ms")
        assert cell.read(drives["x"].position)[0] == 0.25


def test_a_device_without_services_says_so() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        io = rtp.physical_device(
            "io", gpac.drivers.scripted([{"name": "gate", "direction": "read", "type": "bool"}]), exchange=rtp.timer("slow", "10 ms", 50)
        )
        assert repr(io.services) == "services of io: none"
        assert io.counters == {}
        with pytest.raises(gpac.UnknownName, match="use a device whose driver declares services"):
            io.services.home()
