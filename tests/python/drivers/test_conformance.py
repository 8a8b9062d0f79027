# SPDX-License-Identifier: Apache-2.0
"""The conformance kit on the command line: its output, and that a driver created by `opengpac new driver` passes it."""

from __future__ import annotations

import io
import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import opengpac as gpac
from kit_of_drivers import checked
from opengpac.cli import main

EXAMPLES = Path(__file__).parents[3] / "examples" / "drivers"


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Provides a folder for files and compiled code."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


def build(crate: str) -> None:
    """Builds a crate without compiler warnings."""
    words = ["cargo", "build", "--release", "--quiet", "--offline"]
    built = subprocess.run(words, cwd=crate, capture_output=True, text=True, check=False)
    assert (built.returncode, built.stderr) == (0, "")


def test_a_driver_that_is_begun_passes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "driver", "axis"]) == 0
    assert main(["new", "driver", "axis"]) == 1, "it is not overwritten"
    assert main(["new", "driver", "Not a name"]) == 1
    assert len(Path("axis.c").read_text().splitlines()) <= 60
    capsys.readouterr()
    assert main(["driver", "check", "--machine-is-safe", "axis.c", "gain=2", "--exchanges", "5000"]) == 0
    assert ", 0 failed, " in capsys.readouterr().out


def test_a_driver_that_is_begun_in_python_passes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "driver", "slow_axis", "--in", "python"]) == 0
    assert "gpac.drivers.python('slow_axis.py')" in capsys.readouterr().out
    assert len(Path("slow_axis.py").read_text().splitlines()) <= 60
    assert ", 0 failed, " in checked("slow_axis.py", "gain=2")
    assert main(["drivers", "show", "slow_axis.py"]) == 0
    assert "SlowAxis: An axis that moves at the commanded speed" in capsys.readouterr().out


def test_a_driver_in_rust_that_is_begun_is_built_and_passes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "driver", "axis", "--in", "rust"]) == 0
    assert main(["new", "driver", "axis", "--in", "rust"]) == 1, "it is not overwritten"
    assert len(Path("axis/src/lib.rs").read_text().splitlines()) <= 60
    build("axis")
    capsys.readouterr()
    assert main(["driver", "check", "--machine-is-safe", "axis/target/release/libaxis.so", "gain=2", "--exchanges", "5000"]) == 0
    assert ", 0 failed, " in capsys.readouterr().out


def test_a_driver_in_rust_has_services_counters_and_a_scan(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "driver", "turntable", "--in", "rust"]) == 0
    source = (EXAMPLES / "turntable.rs").read_text()
    assert len(source.splitlines()) <= 60
    Path("turntable/src/lib.rs").write_text(source)
    build("turntable")
    path = "turntable/target/release/libturntable.so"
    capsys.readouterr()
    assert main(["driver", "check", "--machine-is-safe", path, "gain=2", "--exchanges", "5000"]) == 0
    assert ", 0 failed, " in capsys.readouterr().out
    turntable = gpac.drivers.load(path)
    assert [each["options"] for each in gpac.drivers.scan(turntable().kind)] == [{"gain": 2.0}]
    with gpac.System("line", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        table = fast.processor.physical_device("table", turntable(), exchange=fast)
        cell.advance("10 ms")
        table.services.call_here(position="90 deg")
        assert table.services.place() == pytest.approx(math.pi / 2)
        assert table.counters["exchanges"] >= 10
    with pytest.raises(gpac.Error, match="option 'gain': -1 is not above 0"), gpac.System("line", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        fast.processor.physical_device("table", turntable(gain=-1.0), exchange=fast)


def test_the_interface_in_rust_is_the_one_of_this_system() -> None:
    root = EXAMPLES.parents[1]
    loads = root / "crates" / "driver-kit" / "src" / "foreign"
    (interface,) = re.findall(r'#\[path = "(.*)"\]\npub mod abi;', (loads / "mod.rs").read_text())
    assert (loads / interface).resolve() == root / "python" / "opengpac" / "drivers" / "rust" / "abi.rs", "both sides are one text"


def test_a_failed_check_is_shown_with_its_cause(capsys: pytest.CaptureFixture[str]) -> None:
    text = (EXAMPLES / "conveyor.c").read_text()
    rests = "conveyor_safe_state(struct conveyor *self) { self->speed = 0.0; }"
    assert rests in text
    Path("conveyor.c").write_text(text.replace(rests, rests.replace("self->speed = 0.0;", "(void)self;")))
    assert main(["driver", "check", "--machine-is-safe", "conveyor.c", "--exchanges", "5000"]) == 1
    printed = capsys.readouterr().out
    assert printed.startswith("FAILED  safe-rests") and "'belt' goes from" in printed and ", 1 failed, " in printed
    assert main(["driver", "check", "--machine-is-safe", "conveyor.c", "--exchanges", "5000", "--json"]) == 1
    (report,) = json.loads(capsys.readouterr().out)
    assert [check["check"] for check in report["checks"] if check["verdict"] == "failed"] == ["safe-rests"]
    assert len(report["checks"]) >= 40


def test_a_driver_that_is_known_is_checked_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["driver", "check", "loopback", 'parts=["x"]', "--exchanges", "5000", "-v"]) == 0
    assert "passed  allocation" in capsys.readouterr().out
    assert main(["driver", "check", "--machine-is-safe", "lopback"]) == 1
    assert "did you mean 'loopback'" in capsys.readouterr().out


def test_extreme_commands_are_sent_only_where_somebody_says_that_the_machine_is_safe(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(EXAMPLES / "conveyor.c", "conveyor.c")
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    assert main(["driver", "check", "conveyor.c"]) == 1
    printed = capfd.readouterr()
    assert "pass --machine-is-safe" in printed.err + printed.out
