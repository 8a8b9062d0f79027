# SPDX-License-Identifier: Apache-2.0
"""FMUs with inputs of every kind, and damaged files: each is used as FMI prescribes, or refused in a sentence with its name."""

import random
import zipfile
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from fmi.making import VARIABLES_2, VARIABLES_3, description, lag

GEAR_2 = '<ScalarVariable name="gear" valueReference="10" causality="input" variability="discrete"><Integer start="3"/></ScalarVariable>'
GEAR_3 = '<Int32 name="gear" valueReference="10" causality="input" variability="discrete" start="3"/>'
SEEN_2 = '<ScalarVariable name="seen" valueReference="10" causality="output" variability="discrete"><Integer/></ScalarVariable>'
SEEN_3 = '<Int32 name="seen" valueReference="10" causality="output" variability="discrete"/>'


def geared(file: Path, version: int) -> Path:
    """Writes the lag with an integer input that cannot be 0, and starts at 3."""
    variables = VARIABLES_2 + GEAR_2 + SEEN_2 if version == 2 else VARIABLES_3 + GEAR_3 + SEEN_3
    return lag(file, version, xml=description(version, variables=variables))


@pytest.mark.parametrize("version", [2, 3])
def test_an_input_of_integers_starts_where_the_fmu_says(tmp_path: Path, version: int) -> None:
    block = gpac.fmu(geared(tmp_path / "geared.fmu", version))
    ran = block.run(u=[0.0] * 2, hold=[False] * 2, gear=[3, 4])
    assert ran.fault is None and ran.seen.tolist() == [3, 4]


@pytest.mark.parametrize("version", [2, 3])
def test_a_device_has_channels_of_integers(tmp_path: Path, version: int) -> None:
    cell = gpac.System("cell", clock="virtual")
    slow = cell.processor("rtp0").timer("slow", period="0.1 s")
    driver = gpac.drivers.fmu(geared(tmp_path / "geared.fmu", version), step="0.1 s", inputs=["gear", "hold"], outputs=["seen", "y"])
    device = cell.processors["rtp0"].physical_device("geared", driver, exchange=slow)
    cell.advance("0.3 s")
    assert cell.read(device["seen"])[0] == 3


DAMAGES: dict[str, tuple[str, str, str]] = {
    "a reference": ('valueReference="1"', 'valueReference="one"', "valueReference of ScalarVariable 'u' is 'one'"),
    "a negative reference": ('valueReference="1"', 'valueReference="-1"', "valueReference of ScalarVariable 'u' is '-1'"),
    "a start": ('<Real start="2"', '<Real start="two"', "the start value of variable 'k' of 'x.fmu' is not valid: 'two'"),
    "an infinite start": ('<Real start="2"', '<Real start="INF"', "the start value of variable 'k' of 'x.fmu' is not valid: 'INF'"),
    "a start of integers": (
        '<Integer start="0"',
        '<Integer start="0.5"',
        "the start value of variable 'mode' of 'x.fmu' is not valid: '0.5'",
    ),
    "a start that is too large": (
        '<Integer start="0"',
        '<Integer start="4294967296"',
        "variable 'mode' of 'x.fmu' is not valid: '4294967296'",
    ),
    "a truth value": ('<Boolean start="false"', '<Boolean start="no"', "the start value of variable 'hold' of 'x.fmu' is not valid: 'no'"),
    "a step": ('<DefaultExperiment startTime="0"/>', '<DefaultExperiment stepSize="fast"/>', "stepSize of DefaultExperiment is 'fast'"),
    "an endless step": ('<DefaultExperiment startTime="0"/>', '<DefaultExperiment stepSize="INF"/>', "DefaultExperiment is 'INF'"),
    "a unit's power": ('kg="1" m="2"', 'kg="one" m="2"', ""),
    "an encoding": ('encoding="UTF-8"', 'encoding="klingon"', "modelDescription.xml of 'x.fmu' is damaged"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_number_that_is_none_is_told_with_its_place(tmp_path: Path, damage: str) -> None:
    good, bad, words = DAMAGES[damage]
    xml = description(2)
    assert good in xml
    file = lag(tmp_path / "x.fmu", 2, xml=xml.replace(good, bad))
    if not words:
        gpac.fmu(file, units={"u": "V", "y": "V"})
        return
    with pytest.raises(gpac.errors.ModuleError) as refusal:
        gpac.fmu(file)
    assert words in str(refusal.value)


LENGTHS = [("-3", "is '-3'"), ("ten", "is 'ten'"), ("0", "number of elements: 0"), ("99999999", "number of elements: 99999999")]


@pytest.mark.parametrize(("length", "words"), LENGTHS)
def test_the_length_of_an_array_is_bounded(tmp_path: Path, length: str, words: str) -> None:
    array = f'<Float64 name="wide" valueReference="20" causality="output"><Dimension start="{length}"/></Float64>'
    file = lag(tmp_path / "x.fmu", 3, xml=description(3, variables=VARIABLES_3 + array))
    with pytest.raises(gpac.errors.ModuleError) as refusal:
        gpac.fmu(file)
    assert words in str(refusal.value)


def test_what_would_fill_the_disk_is_refused_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENGPAC_COMPILED", str(tmp_path / "kept"))
    file = lag(tmp_path / "bomb.fmu", 2)
    with zipfile.ZipFile(file, "a", zipfile.ZIP_DEFLATED) as archive, archive.open("resources/zeros.bin", "w", force_zip64=True) as entry:
        for _ in range(600):
            entry.write(bytes(1 << 20))
    assert file.stat().st_size < 2 << 20
    with pytest.raises(gpac.errors.ModuleError, match=r"of 'bomb.fmu' would be 629 MB unpacked, more than 537 MB"):
        gpac.fmu(file)
    assert sum(kept.stat().st_size for kept in tmp_path.joinpath("kept").rglob("*") if kept.is_file()) == 0


def test_damaged_archives_are_refused_by_their_name(tmp_path: Path) -> None:
    """Bytes of a good FMU are changed: a file that is still usable is used, and any other is refused in a sentence."""
    good = lag(tmp_path / "good.fmu", 2).read_bytes()
    seed = random.randrange(2**32)
    rng = random.Random(seed)
    directory = good.index(b"PK\x01\x02")
    file = tmp_path / "x.fmu"
    said: dict[str, Any] = {}
    for round in range(120):
        damaged = bytearray(good)
        # Half of the changes are in the directory, which contains sizes, flags and methods.
        for _ in range(rng.randrange(1, 4)):
            damaged[rng.randrange(directory if round % 2 else 0, len(good))] ^= 1 << rng.randrange(8)
        file.write_bytes(damaged if round % 5 else damaged[: rng.randrange(len(good))])
        try:
            gpac.drivers.fmu(file, step="10 ms")
        except gpac.Error as refusal:
            said[str(refusal).partition(" at ")[0]] = round
            assert "x.fmu" in str(refusal), f"seed {seed}, round {round}: {refusal}"
    assert said, f"seed {seed}"


def test_an_encrypted_archive_is_refused(tmp_path: Path) -> None:
    content = bytearray(lag(tmp_path / "x.fmu", 2).read_bytes())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        start = content.index(mark)
        content[start + at] |= 1
    (tmp_path / "x.fmu").write_bytes(content)
    with pytest.raises(gpac.errors.ModuleError, match=r"'x.fmu' is encrypted"):
        gpac.fmu(tmp_path / "x.fmu")
