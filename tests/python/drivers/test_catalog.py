# SPDX-License-Identifier: Apache-2.0
"""Declarations of drivers, and their searches for devices: in Python and on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import _native
from opengpac.cli import main
from opengpac.drivers import Manual, Manuals, catalog


def test_each_driver_is_listed_with_its_declaration() -> None:
    listed = gpac.drivers.list()
    kinds = [manual.kind for manual in listed]
    assert kinds == sorted(kinds)
    assert {"loopback", "mujoco", "plant_process", "scripted"} <= {*kinds}
    for manual in listed:
        assert manual.doc and manual.class_ in ("inline", "worker", "process"), manual.kind
        assert manual.safe_state["doc"] and manual.safe_state["by"], manual.kind
        assert all(option["doc"] for option in manual.options), manual.kind


def test_a_manual_prints_everything() -> None:
    shown = str(gpac.drivers.show("loopback"))
    for line in (
        "loopback: parts that follow their effort exactly, x' = u, for tests",
        "exchanges: on the thread of its source",
        "safe state: each output carries its safe value, by driver and end of process",
        "can search for devices: no",
    ):
        assert line in shown.splitlines()
    assert "fail_at_ns" in shown and "never" in shown
    assert "place" in shown and "readings" in shown
    with pytest.raises(gpac.UnknownName, match="did you mean 'loopback'"):
        gpac.drivers.show("lopback")


def test_a_plant_that_runs_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    listed = gpac.drivers.list()
    with gpac.System("cell") as cell:
        rtp = cell.processor("rtp0")
        driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"))
        rtp.physical_device("plant", driver, exchange=rtp.timer("fast", period="2 ms", priority=50))
        found = [device for device in gpac.drivers.scan("plant_process") if device["options"]["name"] == driver.options["name"]]
        assert [device["what"] for device in found] == [f"plant '{driver.options['name']}' of driver 'loopback', 4 channels"]
        assert found[0]["options"]["driver"]["options"]["parts"] == ["x"]
        monkeypatch.setattr(catalog, "list", lambda: Manuals(manual for manual in listed if manual.kind in ("loopback", "plant_process")))
        assert driver.options["name"] in str(gpac.drivers.scan()), "all that can look do"


def test_a_driver_that_cannot_look_says_so() -> None:
    with pytest.raises(gpac.CallError, match="driver 'loopback' cannot search for devices"):
        gpac.drivers.scan("loopback")
    with pytest.raises(gpac.UnknownName, match="did you mean 'loopback'"):
        gpac.drivers.scan("lopback")
    with pytest.raises(gpac.CallError, match="did you mean 'name'"):
        gpac.drivers.scan("plant_process", nam="x")


def test_the_command_lists_and_shows(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drivers"]) == 0
    assert "plant_process" in capsys.readouterr().out
    assert main(["drivers", "show", "loopback", "scripted"]) == 0
    shown = capsys.readouterr().out
    assert "loopback: parts" in shown and "scripted: " in shown
    assert main(["drivers", "show"]) == 1
    assert main(["drivers", "show", "lopback"]) == 1
    assert "did you mean 'loopback'" in capsys.readouterr().err


def test_the_command_looks_for_devices(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices", "scan", "plant_process", "--name", "nobody", "--step", "1 ms"]) == 0
    assert "found" in capsys.readouterr().out
    assert main(["devices", "scan", "plant_process", "--nme=x"]) == 1
    assert "did you mean 'name'" in capsys.readouterr().err
    assert main(["devices", "scan", "loopback"]) == 1
    assert "cannot search for devices" in capsys.readouterr().err


def test_a_driver_that_fails_to_look_keeps_no_other_from_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def look(kind: str, options: str) -> str:
        if kind == "a":
            raise _native.Refused('[{"class": "DeviceFailed", "message": "the line is in use"}]')
        return '[{"what": "a device", "options": {"port": 1}}]'

    about = dict(gpac.drivers.show("plant_process").about)
    monkeypatch.setattr(catalog, "list", lambda: Manuals(Manual({**about, "kind": kind}) for kind in "ab"))
    monkeypatch.setattr(_native, "scan", look)
    found = gpac.drivers.scan()
    assert [*found] == [{"driver": "b", "what": "a device", "options": {"port": 1}}]
    assert found.problems == {"a": "the line is in use"}
    assert str(found).splitlines()[:2] == ["1 device found", "a: the line is in use"]


LAMPS = """
from opengpac.driver import Driver, Option, write


class Lamps(Driver):
    "Lamps on a line."

    line: str = Option("the line")
    count: int = Option("how many there are", 4)

    lit = write("double")

    @classmethod
    def scan(cls, line="a", count=0):
        ANSWER

    def exchange(self): ...
"""


def lamps(folder: Path, answer: str) -> str:
    file = folder / f"lamps_{len([*folder.iterdir()])}.py"
    file.write_text(LAMPS.replace("ANSWER", answer))
    return str(file)


def test_the_driver_of_a_file_is_shown_and_looks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = lamps(tmp_path, 'return [{"what": f"{count} lamps", "options": {"line": line, "count": count}}]')
    found = gpac.drivers.scan(file, line="b", count=2)
    assert found == [{"driver": "Lamps", "what": "2 lamps", "options": {"line": "b", "count": 2}}]
    assert f"can search for devices: opengpac devices scan {file}" in str(gpac.drivers.show(file))
    assert main(["devices", "scan", file, "--line", "c", "--count", "3"]) == 0
    assert '{"line": "c", "count": 3}' in capsys.readouterr().out

    conveyor = str(Path(__file__).parents[3] / "examples" / "drivers" / "conveyor.c")
    assert main(["drivers", "show", conveyor]) == 0
    shown = capsys.readouterr().out
    assert "conveyor: A conveyor" in shown and "place" in shown and "can search for devices: no" in shown
    assert [manual.kind for manual in gpac.drivers.manuals(conveyor)] == ["conveyor"]
    with pytest.raises(gpac.CallError, match="driver 'conveyor' cannot search for devices"):
        gpac.drivers.scan(gpac.drivers.load(conveyor)().kind)
    assert main(["devices", "scan", conveyor]) == 1
    assert "driver 'conveyor' cannot search for devices" in capsys.readouterr().err


def test_a_scan_in_python_that_fails_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(gpac.DeviceFailed, match="driver Lamps cannot search for devices: OSError: the line is cut"):
        gpac.drivers.scan(lamps(tmp_path, 'raise OSError("the line is cut")'))
    with pytest.raises(gpac.DeviceFailed, match=r"scan\(\) of driver Lamps returns invalid results: KeyError: 'options'"):
        gpac.drivers.scan(lamps(tmp_path, 'return [{"what": "a lamp"}]'))
    file = lamps(tmp_path, "return []")
    with pytest.raises(gpac.CallError, match="did you mean 'count'"):
        gpac.drivers.scan(file, coutn=1)
    with pytest.raises(gpac.CallError, match="pass such a value: how many"):
        gpac.drivers.scan(file, count="many")
    without = str(Path(__file__).parent / "furnace.py")
    with pytest.raises(gpac.CallError, match="driver 'Furnace' cannot search for devices"):
        gpac.drivers.scan(without)
    assert main(["devices", "scan", "--on", "unix:///run/cell.sock", file]) == 1
    assert "can search only the host that has the file" in capsys.readouterr().err
