# SPDX-License-Identifier: Apache-2.0
"""Recordings: every value can be read back; ends of recordings, refusals; the commands `record` and `plot`."""

from __future__ import annotations

import csv
import json
import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from daemons import Daemon
from opengpac import activate, cli
from opengpac import library as lib


def wave(name: str = "wave") -> gpac.Verb[..., Any]:
    return gpac.Verb(
        name,
        blocks={"wave": lib.signal_generator, "gain": lib.gain},
        instantiation_parameters={"y": ["gain.y"]},
        cells={"u": ["wave.y", "gain.u"]},
        input_parameters={"shape": gpac.input("wave.shape", default=1)},
        command_lists={"start": [activate("wave", every="1 ms"), activate("gain")]},
    )


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("recorded", clock="virtual") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        yield cell


def run(cell: gpac.System, svv: str, **options: Any) -> Any:
    return wave().on(cell.sources["rtp0.fast"]).asynch(cell.svv(svv, **options))


def test_every_value_comes_back_as_an_array(cell: gpac.System, tmp_path: Path) -> None:
    recording = cell.record(tmp_path / "run.mcap", cells=True)
    instance = run(cell, "joint.q", unit="rad", history=2000)
    cell.advance("2 s")
    assert recording.running
    assert recording.stop() == {}
    assert "nothing lost" in repr(recording)
    recorded = gpac.open_recording(recording.path)
    assert recorded.complete and recorded.lost == {}
    history = cell._svv("joint.q").history[:]
    taken = recorded["joint.q"]
    assert np.array_equal(taken[1:]["value"], history["value"]) and np.array_equal(taken[1:]["number"], history["number"])
    assert np.allclose(taken[1:]["time"], history["time"], atol=1e-9)
    assert recorded.unit("joint.q") == "rad"
    assert np.array_equal(recorded[f"{instance.name}:u"][-2000:]["number"], history["number"])
    assert recording.counts["joint.q"] == 2001
    told = [(entry["kind"], entry.get("who")) for entry in recorded.log if entry["about"] == instance.name]
    assert told[0] == ("command", "program") and told[1][0] == "start"
    assert recorded.timing["rtp0.fast"][-1]["firings"] >= 1000


def test_a_system_that_closes_ends_its_recordings(cell: gpac.System, tmp_path: Path) -> None:
    with cell.record(tmp_path / "run.mcap", svvs=["arm.*"]) as recording:
        run(cell, "arm.q")
        cell.svv("leg.q")
        cell.advance("100 ms")
        cell.close()
    assert not recording.running
    recorded = gpac.open_recording(tmp_path / "run.mcap")
    assert list(recorded) == ["arm.q"]
    assert recorded.ends[0]["report"]["verb"] == "wave"
    assert recorded.conditions == []


def test_what_cannot_be_recorded_or_read_is_said(cell: gpac.System, tmp_path: Path) -> None:
    cell.svv("arm.q")
    with pytest.raises(gpac.UnknownName, match=r"there is no SVV 'arm\.p'"):
        cell.record(tmp_path / "run.mcap", svvs=["arm.p"])
    with pytest.raises(gpac.ValueRefused, match="cannot record into"):
        cell.record(tmp_path / "no" / "run.mcap")
    with pytest.raises(gpac.CallError, match=r"argument 'svvs' of record\(\)"):
        cell.record(tmp_path / "run.mcap", svvs="arm.*")
    assert list(tmp_path.iterdir()) == []
    cell.record(tmp_path / "run.mcap").stop()
    with pytest.raises(gpac.ValueRefused, match="another name"):
        cell.record(tmp_path / "run.mcap")
    with pytest.raises(KeyError, match=r"did you mean 'arm\.q'"):
        gpac.open_recording(tmp_path / "run.mcap")["arm.qq"]
    with pytest.raises(gpac.ValueRefused, match="cannot read recording"):
        gpac.open_recording(tmp_path / "none.mcap")


def test_mcap_itself_reads_it(cell: gpac.System, tmp_path: Path) -> None:
    from mcap import reader

    recording = cell.record(tmp_path / "run.mcap")
    run(cell, "q", unit="rad")
    cell.advance("3 s")
    recording.stop()
    with open(tmp_path / "run.mcap", "rb") as file:
        read = reader.make_reader(file, validate_crcs=True)
        summary = read.get_summary()
        assert summary is not None and summary.statistics is not None
        written = summary.statistics.channel_message_counts
        counts = {channel.topic: written.get(id, 0) for id, channel in summary.channels.items()}
        assert {topic: count for topic, count in counts.items() if count} == {t: c for t, c in recording.counts.items() if c}
        messages = [(message.log_time, message.data) for _, _, message in read.iter_messages(topics=["q"])]
    assert len(messages) == 3001
    assert messages[-1][0] == 3_000_000_000 and messages[-1][1].startswith(b'{"number":2999,"value":')


PROGRAM = """
import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

cell = gpac.System("programmed", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
wave = gpac.Verb("wave", blocks={"w": lib.signal_generator}, instantiation_parameters={"y": "w.y"},
                 input_parameters={"shape": gpac.input("w.shape", default=1)},
                 command_lists={"start": [activate("w", every="1 ms")]})
wave.on(fast).asynch(cell.svv("joint1.sensed", unit="rad"))
cell.svv("joint2.sensed", unit="m")
cell.advance("1 s")
"""


def test_a_program_is_recorded_and_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program, file = tmp_path / "program.py", tmp_path / "run.mcap"
    program.write_text(PROGRAM)
    assert cli.main(["record", "-o", str(file), str(program)]) == 0
    assert "nothing lost" in capsys.readouterr().err
    assert cli.main(["replay", str(file)]) == 0
    assert "all values equal to the recorded ones" in capsys.readouterr().out
    picture, table = tmp_path / "run.png", tmp_path / "run.csv"
    assert cli.main(["plot", str(file), "joint*.sensed", "--from", "200 ms", "--to", "0.5 s", "-o", str(picture), "--csv", str(table)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    with open(table) as text:
        rows = list(csv.DictReader(text))
    assert len(rows) == 301 and {row["name"] for row in rows} == {"joint1.sensed"}
    recorded = gpac.open_recording(file)["joint1.sensed"]
    assert [float(row["value"]) for row in rows] == recorded[(recorded["time"] >= 0.2) & (recorded["time"] <= 0.5)]["value"].tolist()
    capsys.readouterr()
    assert cli.main(["plot", str(file), "joint1.sensd"]) == 1
    assert "did you mean 'joint1.sensed'?" in capsys.readouterr().err


def test_a_program_without_replay_and_a_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program, file = tmp_path / "program.py", tmp_path / "own.mcap"
    first, rest = PROGRAM.split("cell = ", 1)
    made, then = rest.split("\n", 1)
    program.write_text(
        f"{first}cell = {made}\nrecording = cell.record({str(file)!r}, replay=True)\n{then}\nassert recording.stop() == {{}}\n"
        "cell.close()\n"
    )
    assert cli.main(["check", str(program)]) == 0
    assert not file.exists(), "a check records nothing"
    assert cli.main(["run", str(program)]) == 0
    assert gpac.replay(file).same
    file.unlink()
    program.write_text(PROGRAM)
    assert cli.main(["record", "--no-replay", "-o", str(file), str(program)]) == 0
    with pytest.raises(gpac.CallError, match="nothing to replay"):
        gpac.replay(file)
    assert len(gpac.open_recording(file)["joint1.sensed"]) == 1001


READS_BACK = """
import opengpac as gpac
cell = gpac.System("checked")
q, level = cell.svv("joint.q", "double[6]", unit="rad"), cell.svv("level")
cell.record("run.mcap", {svvs}, replay={replay}, cells=True)
cell.close()
print(gpac.replay("run.mcap"))
recorded = gpac.open_recording("run.mcap")
print(recorded, recorded["joint.q"]["value"].shape, recorded.unit("joint.q"), len(recorded["move#1:u"]), recorded.ends, recorded.timing)
print(recorded.names("lev*"))
"""


def test_a_checked_program_reads_back_what_it_would_have_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    program = tmp_path / "program.py"
    program.write_text(READS_BACK.format(svvs=None, replay=True))
    assert cli.main(["check", str(program)]) == 0, capsys.readouterr().err
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("0 firings, all values equal to the recorded ones; nothing ran: the program is only being checked")
    assert "2 SVVs and cells, 0 values, nothing lost (0, 6) rad 0 [] {}" in told[1] and told[2] == "['level']"
    assert not Path("run.mcap").exists()
    # The check refuses the same as a run.
    program.write_text(READS_BACK.format(svvs=["joint.*"], replay=False))
    assert cli.main(["check", str(program)]) == 1
    told = capsys.readouterr().err
    assert "program.py:7:" in told and "contains nothing to replay\n" in told and "cell.record(path, replay=True)" in told
    assert "program.py:10:" in told and "has no SVV 'lev*'" in told


def test_a_daemon_records_in_its_folder_or_refuses(tmp_path: Path) -> None:
    folder = tmp_path / "records"
    folder.mkdir()
    served = Daemon(tmp_path, "virtual", "--records", str(folder))
    try:
        with gpac.connect(served.url) as cell:
            with pytest.raises(gpac.CallError, match="without folders"):
                cell.record("../run.mcap")
            with cell.record("run.mcap", replay=True) as recording:
                cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
                run(cell, "q")
                cell.advance("1 s")
            assert recording.lost == {} and not recording.running
    finally:
        served.stop()
    assert gpac.replay(folder / "run.mcap").same
    assert len(gpac.open_recording(folder / "run.mcap")["q"]) == 1001


def test_the_metadata_of_a_recording_for_a_replay_has_the_hardware(tmp_path: Path) -> None:
    """The recording begins before there is any."""
    with gpac.System("cell", clock="virtual") as cell:
        recording = cell.record(tmp_path / "run.mcap", replay=True)
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        fast.processor.physical_device("drives", gpac.drivers.loopback("elbow"), exchange=fast)
        cell.svv("level").value = 2.0
        cell.advance("10 ms")
        recording.stop()
    said = json.loads(gpac.open_recording(tmp_path / "run.mcap").metadata["opengpac"]["configuration"])
    assert (list(said["processors"]), list(said["sources"]), list(said["physical_devices"])) == (["rtp0"], ["rtp0.fast"], ["drives"])


def test_alarms_are_recorded_at_the_time_at_which_they_came(tmp_path: Path) -> None:
    """The recorder polls in real time, in which a virtual minute may pass."""
    from mcap import reader

    path = tmp_path / "alarms.mcap"
    with gpac.System("cell", clock="virtual") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms")
        cell.alarms.define("hot", "the drive is too warm", severity="medium")
        with cell.record(path):
            cell.advance("2 s")
            cell.alarms.trip("hot", source="drive")
            cell.advance("60 s")
    with path.open("rb") as file:
        rows = [
            (message.log_time, [alarm["code"] for alarm in json.loads(message.data)["current"]])
            for _, channel, message in reader.make_reader(file).iter_messages(topics=["/alarms"])
        ]
    assert [time for time, codes in rows if codes == ["hot"]] == [2_000_000_000], rows


def messages_of(path: Path) -> dict[str, list[tuple[int, float]]]:
    """Returns times in ns and values of the SVVs of an intact file, as the package `mcap` reads it."""
    from mcap import reader

    found: dict[str, list[tuple[int, float]]] = {}
    with open(path, "rb") as file:
        for _, channel, message in reader.make_reader(file).iter_messages():
            if "kind" in channel.metadata:
                found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)["value"]))
    return found


def chunks_of(path: Path) -> list[tuple[range, int, int]]:
    """Returns place, first and last time of each chunk of an intact file, as the package `mcap` reads its summary."""
    from mcap import reader

    with open(path, "rb") as file:
        summary = reader.make_reader(file).get_summary()
        assert summary
        found: list[tuple[range, int, int]] = []
        for one in summary.chunk_indexes:
            place = range(one.chunk_start_offset, one.chunk_start_offset + one.chunk_length)
            found.append((place, one.message_start_time, one.message_end_time))
        return found


TURNED = int(os.environ.get("OPENGPAC_TURNED", "60"))
"""Number of damaged recordings that are read."""


def test_a_damaged_recording_has_everything_but_the_chunks_that_were_hit(cell: gpac.System, tmp_path: Path) -> None:
    path, damaged = tmp_path / "run.mcap", tmp_path / "damaged.mcap"
    with cell.record(path):
        for svv in ("a", "b"):
            run(cell, svv)
        cell.advance("12 s")
    whole, places, bytes_of = messages_of(path), chunks_of(path), path.read_bytes()
    assert len(places) >= 3
    draw = np.random.default_rng(30)
    for number in range(TURNED):
        turned = bytearray(bytes_of)
        bits = [(int(draw.integers(8, len(bytes_of))), int(draw.integers(8))) for _ in range(1 + number % 8)]
        for at, bit in bits:
            turned[at] ^= 1 << bit
        damaged.write_bytes(turned)
        hit = [place for place in places if any(turned[at] != bytes_of[at] for at in place[0])]
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            recorded = gpac.open_recording(damaged)
        for begins, ends in [(place.start, place.stop) for place, _, _ in hit]:
            assert any(one.begins < ends and begins < one.ends for one in recorded.damage), f"{bits}: the chunk at {begins} is not told"
        assert bool(recorded.damage) == bool(told) and (not told or str(damaged) in str(told[0].message)), bits
        lost = 0
        for name, messages in whole.items():
            series = recorded.get(name, {"time": [], "value": []})
            got = [(round(time * 1e9), value) for time, value in zip(series["time"], series["value"], strict=True)]
            assert set(got) <= set(messages), f"{bits}: values of {name} that were not recorded"
            missing = set(messages) - set(got)
            lost += len(missing)
            assert all(any(first <= time <= last for _, first, last in hit) for time, _ in missing), f"{bits}: {len(missing)} of {name}"
        if lost and len(bits) == 1:
            [(place, *times)], [one] = hit, recorded.damage
            assert (one.begins, one.ends) == (place.start, place.stop)
            assert one.lost and one.lost.get("a", 0) + one.lost.get("b", 0) == lost
            assert one.span and [round(one.span[0] * 1e9), round(one.span[1] * 1e9)] == times
            assert f"{sum(one.lost.values())} messages of" in str(told[0].message)


def test_a_recording_without_its_tail_says_where_it_ends(cell: gpac.System, tmp_path: Path) -> None:
    path, cut = tmp_path / "run.mcap", tmp_path / "cut.mcap"
    with cell.record(path):
        run(cell, "a")
        cell.advance("30 s")
    whole, places, bytes_of = messages_of(path), chunks_of(path), path.read_bytes()
    place, first, last = places[-2]
    cut.write_bytes(bytes_of[: (place.start + place.stop) // 2])
    with pytest.warns(UserWarning, match="ends within a record"):
        recorded = gpac.open_recording(cut)
    assert not recorded.complete
    [one] = recorded.damage
    assert one.begins == place.start and one.span and (round(one.span[0] * 1e9), round(one.span[1] * 1e9)) == (first, last)
    got = [round(time * 1e9) for time in recorded["a"]["time"]]
    assert got == [time for time, _ in whole["a"] if time < first], "every value of the chunks before"


def test_files_follow_each_other_and_the_newest_stay(cell: gpac.System, tmp_path: Path) -> None:
    with cell.record(tmp_path / "run.mcap", split="1 MB", keep=3) as recording:
        run(cell, "y")
        cell.advance("120 s")
    files = [Path(file) for file in recording.files]
    assert len(files) == 3 and sorted(files) == sorted(tmp_path.iterdir()) and files[-1].stem.startswith("run-")
    assert recording.bytes == sum(file.stat().st_size for file in files)
    assert recording.free_bytes is not None and recording.free_bytes > 0
    parts = [gpac.open_recording(file) for file in files]
    for before, after, file in zip(parts, parts[1:], files, strict=False):
        assert after["y"][0] == before["y"][-1] and after.metadata["opengpac"]["follows"] == file.name
    assert parts[-1]["y"][-1]["time"] == pytest.approx(120.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"split": "1 MB", "replay": True}, "a recording for a replay is a single file"),
        ({"keep": 3}, "the size at which the next file begins"),
        ({"split": "10 kB"}, "give 1 MB or more"),
        ({"split": "1 MB", "keep": 1}, "keep 2 or more"),
        ({"split": "much"}, "split= must be a size, not 'much'; write '500 MB'"),
        ({"split": "5 mb"}, "write one of the units B, kB, MB"),
        ({"split": -1}, "must be a size, not"),
        ({"split": "1 MB", "keep": -1}, "keep= must be at least 2, not -1"),
    ],
)
def test_bounds_that_cannot_be_kept_are_refused(cell: gpac.System, tmp_path: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(gpac.ValueRefused) as refused:
        cell.record(tmp_path / "run.mcap", **options)
    assert words in str(refused.value)
    assert not [*tmp_path.iterdir()]


def test_the_command_splits_too(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import opengpac as gpac\nfrom opengpac import activate, library\n"
        "cell = gpac.System('cell', clock='virtual')\nfast = cell.processor('rtp0').timer('fast', period='1 ms', priority=80)\n"
        "wave = gpac.Verb('wave', blocks={'wave': library.signal_generator(shape=1)}, instantiation_parameters={'y': 'wave.y'},\n"
        "    command_lists={'start': [activate('wave', every='1 ms')]})\n"
        "wave.on(fast).asynch(cell.svv('y'))\ncell.advance('60 s')\n"
    )
    assert cli.main(["record", "-o", str(tmp_path / "run.mcap"), "--no-replay", "--split", "1MB", "--keep", "2", str(program)]) == 0
    assert len([*tmp_path.glob("run*.mcap")]) == 2
