# SPDX-License-Identifier: Apache-2.0
"""Drivers of a user's own, from a source in C: options with units, a moving device, refusals."""

from __future__ import annotations

from pathlib import Path

import pytest

import opengpac as gpac
from afar import looking, pushing, until

EXAMPLES = Path(__file__).parents[3] / "examples" / "drivers"
CONVEYOR = EXAMPLES / "conveyor.c"


@pytest.fixture(autouse=True)
def kept_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keeps compiled code in a folder of the test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_options_have_units_and_are_checked() -> None:
    conveyor = gpac.drivers.load(CONVEYOR)
    assert list(conveyor) == ["conveyor"]
    assert conveyor(gain="200 cm/s").options == {"gain": 2.0}
    assert conveyor(timeout="5 ms").options == {"timeout_ns": 5_000_000}
    assert conveyor().kind == conveyor.conveyor().kind
    assert "gain           number [m/s] within (0, 100], else 1.0: its speed for an effort of 1" in conveyor.help
    with pytest.raises(gpac.CallError, match="option 'gian': the driver has no such option; did you mean 'gain'"):
        conveyor(gian=1)
    with pytest.raises(gpac.CallError, match="option 'gain': it must be a number in m/s, not true"):
        conveyor(gain=True)
    with pytest.raises(gpac.CallError, match="has no driver 'convoyer'"):
        _ = conveyor.convoyer


@pytest.mark.parametrize("apart", [False, True])
def test_a_device_moves_here_and_in_a_process_of_its_own(apart: bool) -> None:
    conveyor = gpac.drivers.load(CONVEYOR)
    with gpac.System("line", clock="monotonic" if apart else "virtual", progress=False) as cell:
        rtp = cell.processor("rtp0", process=apart)
        fast = rtp.timer("fast", period="2 ms", priority=50)
        belt = rtp.physical_device("belt", conveyor(gain=3), exchange=fast)
        place = cell.svv("place")
        looking.on(fast).asynch(channel=belt["belt"].position, q=place)
        pushing.on(fast).asynch(belt["belt"].effort, u=1.0)
        if apart:
            until(lambda: place.value > 0.02, "the belt moves")
        else:
            cell.advance("102 ms")
            assert place.value == pytest.approx(0.3, abs=0.02)


def test_a_folder_has_a_driver_for_each_file(tmp_path: Path) -> None:
    (tmp_path / "conveyor.c").write_text(CONVEYOR.read_text())
    (tmp_path / "second.c").write_text(CONVEYOR.read_text().replace("conveyor", "second"))
    both = gpac.drivers.load(tmp_path)
    assert sorted(both) == ["conveyor", "second"] and both.second(gain=2).options == {"gain": 2}
    with pytest.raises(gpac.CallError, match="has 2 drivers"):
        both()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('DRIVER(axis, "One axis.", optoin_number(gain, 1.0, "gain"))', "is not an item of a driver: use "),
        ("int x = ;", "expected expression"),
        ("", "it has no driver: declare one with DRIVER"),
        ("__attribute__((constructor)) static void f(void) { __builtin_trap(); }", "crashed the process that tried to load it: SIG"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "axis.c"
    file.write_text(f"#include <opengpac_driver.h>\nstruct axis {{ int x; }};\n{text}\n")
    with pytest.raises(gpac.ModuleError) as caught:
        gpac.drivers.load(file)
    assert words in str(caught.value) and "axis.c" in str(caught.value)


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gpac.ModuleError, match="does not exist"):
        gpac.drivers.load(tmp_path / "axis.c")
    with pytest.raises(gpac.ModuleError, match="has no driver"):
        gpac.drivers.load(tmp_path)
    (tmp_path / "axis.txt").write_text("")
    with pytest.raises(gpac.ModuleError, match="is not a driver file"):
        gpac.drivers.load(tmp_path / "axis.txt")
