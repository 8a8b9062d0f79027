# SPDX-License-Identifier: Apache-2.0
"""Services and counters of drivers in Python: declared in the class, checked, and the same wherever the class runs."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until
from opengpac.cli import main
from opengpac.driver import Driver, Option, service

FURNACE = Path(__file__).parent / "furnace.py"


@pytest.fixture(params=["virtual", "threads", "process"])
def furnace(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[gpac.PhysicalDevice]:
    """Yields the furnace, opened in this process, or in a process of its own by a processor here or a separate one."""
    with gpac.System("cell", clock="virtual" if request.param == "virtual" else "monotonic") as cell:
        rtp = cell.processor("rtp0", process=request.param == "process")
        driver = gpac.drivers.python(FURNACE, folder=str(tmp_path), period="5 ms", age_max="20 s")
        yield rtp.physical_device("furnace", driver, exchange=rtp.timer("slow", period="2 ms", priority=50))


def passes(cell: gpac.System) -> None:
    """Advances time, if the clock permits it."""
    with contextlib.suppress(gpac.Error):
        cell.advance("10 ms")


def test_a_service_is_a_typed_method(furnace: gpac.PhysicalDevice, tmp_path: Path) -> None:
    cell = furnace.system
    assert repr(furnace.services.calibrate) == "calibrate(at: float, often: int | None = None) -> float"
    assert (
        furnace.services.calibrate.__doc__
        == "Takes a temperature for that without heat.\n\nat: the temperature that it has without heat, K.\noften: often; default: 1."
    )
    assert furnace.services.calibrate(at=350) == 350.0

    def warm() -> bool:
        passes(cell)
        return bool(cell.read(furnace["temperature"])[0] == 350.0)

    until(warm, "the next exchange sees what the service has changed")
    assert furnace.services.label() is None
    assert (tmp_path / "told").read_text().splitlines()[-1] == "label none"


def test_what_is_wrong_with_an_argument_is_said(furnace: gpac.PhysicalDevice) -> None:
    with pytest.raises(gpac.CallError, match=r"service 'calibrate'.*'at'"):
        furnace.services.calibrate()
    with pytest.raises(gpac.CallError, match=r"'att'.*did you mean 'at'"):
        furnace.services.calibrate(att=3.0)
    with pytest.raises(gpac.CallError, match="'at'"):
        furnace.services.calibrate(at="warm")
    with pytest.raises(gpac.UnknownName, match=r"no service 'calibrat'.*did you mean 'calibrate'"):
        furnace.services.calibrat()
    with pytest.raises(gpac.DeviceFailed, match="ValueError: nobody may call it that"):
        furnace.services.label(text="forbidden")
    with pytest.raises(gpac.DeviceFailed, match="service 'lie' returns 'seven', but declares int"):
        furnace.services.lie()
    passes(furnace.system)
    assert furnace.system.statistics["physical_devices"]["furnace"]["lost"] is None, "a service that fails loses nothing"


def test_what_it_counts_is_in_the_statistics(furnace: gpac.PhysicalDevice) -> None:
    cell = furnace.system

    def counted() -> bool:
        passes(cell)
        return furnace.counters["exchanges"] > 3

    until(counted, "exchanges are counted")
    furnace.services.calibrate(at=300.0, often=2)

    def drafty() -> bool:
        passes(cell)
        return furnace.counters["drafts"] == 2

    until(drafty, "what a service counts is counted too")
    assert cell.statistics["physical_devices"]["furnace"]["counters"].keys() == {"exchanges", "drafts"}
    assert furnace.about["counters"][0] == {"name": "exchanges", "unit": "", "doc": "exchanges so far"}


def test_an_emergency_stop_brings_the_safe_state_and_lets_no_service_move(furnace: gpac.PhysicalDevice, tmp_path: Path) -> None:
    cell = furnace.system

    def told(word: str) -> int:
        passes(cell)
        lines = (tmp_path / "told").read_text().splitlines()
        return sum(line.startswith(word) for line in lines)

    doc = "Opens its door by a motor. It moves the machine and is refused while an emergency stop is latched."
    assert furnace.services.open_door.__doc__ == doc
    furnace.services.open_door()
    assert (told("door"), told("safe")) == (1, 0)
    for stops in (1, 2):
        cell.emergency_stop("somebody came in")
        until(lambda stops=stops: told("safe") == stops, "its safe_state() is called, though nobody has engaged it")
        with pytest.raises(gpac.EmergencyStopped, match=r"'furnace.open_door'.*latched \(somebody came in\); .*reset"):
            furnace.services.open_door()
        furnace.services.label(text="stopped")
        cell.reset()
        furnace.services.open_door()
        exchanges = furnace.counters["exchanges"]

        def goes_on(exchanges: int = exchanges) -> bool:
            passes(cell)
            return furnace.counters["exchanges"] > exchanges + 3

        until(goes_on, "it exchanges behind its stop")
        assert (told("door"), told("safe")) == (1 + stops, stops), "once for each stop"


def test_a_service_that_a_stop_overtakes_on_its_way_moves_nothing(tmp_path: Path) -> None:
    with gpac.System("cell") as cell:
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="2 ms", priority=50)
        furnace = rtp.physical_device("furnace", gpac.drivers.python(FURNACE, folder=str(tmp_path), age_max="60 s"), exchange=slow)
        (tmp_path / "pauses").touch()
        until((tmp_path / "pausing").exists, "its process is in its exchange")
        refused: list[str] = []

        def call() -> None:
            try:
                furnace.services.open_door()
            except gpac.Error as why:
                refused.append(str(why))

        def serving() -> set[str]:
            """Returns the threads that run services; those of an earlier test may still exist."""
            found = set()
            for task in Path("/proc/self/task").iterdir():
                with contextlib.suppress(OSError):
                    if (task / "comm").read_text() == "service\n":
                        found.add(task.name)
            return found

        earlier = serving()
        calling = threading.Thread(target=call)
        calling.start()
        until(lambda: serving() - earlier, "it was let through")
        cell.emergency_stop("somebody came in")
        firings = cell.statistics["sources"][slow.name]["firings"]
        until(lambda: cell.statistics["sources"][slow.name]["firings"] > firings + 1, "its source has seen the stop")
        (tmp_path / "pauses").unlink()
        calling.join()
        assert "service 'open_door' moves the machine, but" in refused[0]
        until(lambda: "safe" in (tmp_path / "told").read_text(), "it is in its safe state")
        assert "door" not in (tmp_path / "told").read_text()


def test_a_service_that_lasts_ends_with_its_device(tmp_path: Path) -> None:
    (tmp_path / "slow.py").write_text(
        "import time\nfrom opengpac.driver import Driver, service\n\n\n"
        "class Slow(Driver):\n    def exchange(self):\n        pass\n\n    @service\n    def sleep(self):\n"
        '        """Never comes back."""\n        time.sleep(3600)\n'
    )
    cell = gpac.System("cell")
    rtp = cell.processor("rtp0")
    device = rtp.physical_device("slow", gpac.drivers.python(tmp_path / "slow.py", age_max="1 s"), exchange=rtp.timer("t", "5 ms", 50))
    ends: list[str] = []

    def call() -> None:
        try:
            device.services.sleep()
        except gpac.Error as why:
            ends.append(str(why))

    calling = threading.Thread(target=call)
    calling.start()
    until(lambda: cell.statistics["physical_devices"]["slow"]["lost"], "its readings are too old meanwhile, so it is lost")
    device.reopen()
    until(lambda: ends, "its process ended, and the call with it")
    calling.join()
    assert "its process ended before it answered" in ends[0]
    cell.close()


def test_a_manual_says_what_the_class_declares(capsys: pytest.CaptureFixture[str]) -> None:
    manual = gpac.drivers.show(str(FURNACE))
    assert (manual.kind, manual.class_) == ("Furnace", "process")
    assert [option["name"] for option in manual.options] == ["folder", "ambient", "levels", "period_ns", "age_max_ns", "timeout_ns"]
    assert main(["drivers", "show", str(FURNACE)]) == 0
    printed = capsys.readouterr().out
    for word in ("Furnace: A furnace that is as warm as its heater says", "calibrate", "exchanges so far", "ambient", "20.0"):
        assert word in printed
    with pytest.raises(gpac.CallError, match=r"file 'nowhere.py' does not exist"):
        gpac.drivers.show("nowhere.py")


def test_what_cannot_be_declared_is_refused() -> None:
    with pytest.raises(gpac.DefinitionError, match="service 'f' has no docstring"):

        class Silent(Driver):
            @service
            def f(self) -> None: ...

    with pytest.raises(gpac.DefinitionError, match="argument 'x' of service 'f' has a type that cannot be sent"):

        class Untyped(Driver):
            @service
            def f(self, x) -> None:  # type: ignore[no-untyped-def]
                """Does nothing."""


def test_a_service_can_be_called_by_itself() -> None:
    class Lamp(Driver):
        """Lamp with a service."""

        @service
        def dim(self, share: float = Option("0 to 1", 0.5), seconds: float = Option("how long", unit="s")) -> float:
            """Dims the lamp."""
            return share * seconds

    assert Lamp().dim(seconds="2 s") == 1.0  # type: ignore[arg-type]
    assert Lamp().dim(1, seconds=3.0) == 3.0
    with pytest.raises(gpac.CallError, match="service 'dim' needs argument 'seconds'; pass seconds: how long"):
        Lamp().dim()
