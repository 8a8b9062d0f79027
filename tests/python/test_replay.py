# SPDX-License-Identifier: Apache-2.0
"""A recorded run is replayed without its program: the same values, a condition to stop at, the first difference with other code."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until
from opengpac import _native, activate
from opengpac import library as lib
from opengpac.cli import main

_BLOCK = """// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(counter, "Counts its invocations, with a jump.",
    out  (double, y,      "the count"),
    param(double, step, 1.0, "by how much"),
    state(double, n, 0.0, "invocations so far"))
{{
    self->n += self->step{jump};
    self->y = self->n;
    return OK;
}}

FUNCTION_BLOCK(reader, "What is newest.",
    in_async(double, u, "a count"),
    out     (double, y, "the same"))
{{
    self->y = self->u;
    return OK;
}}
"""


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """Returns a record of 100 ms of a counter in C whose count another source reads."""
    source = tmp_path / "counting.c"
    source.write_text(_BLOCK.format(jump=""))
    path = tmp_path / "run.mcap"
    with gpac.System("recorded", clock="virtual") as cell:
        cell.record(path, replay=True)
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        slow = rtp.timer("slow", period="5 ms", priority=40)
        count = cell.svv("count", "double")
        module = cell.download(source)
        verb = gpac.Verb(
            "counts",
            blocks={"counter": module["counter"], "reader": module["reader"]},
            instantiation_parameters={"y": ["counter.y", "reader.u"]},
            cells={"read": "reader.y"},
            command_lists={"start": [activate("counter", every="1 ms"), activate("reader", every="5 ms")]},
        )
        counts = verb.on({"counter": fast, "reader": slow}).asynch(count)
        cell.advance("100 ms")
        assert count.value == 100.0
        counts.halt()
    return path


def test_every_value_is_as_it_was_recorded(record: Path) -> None:
    again = gpac.replay(record, show=["cou*"], trust=True)
    assert (again.stopped, again.same, again.difference) == ("end", True, None)
    assert again.firings >= 120
    assert again.svvs == {"count": ("100.0",)}


def test_it_stops_where_a_condition_holds(record: Path) -> None:
    again = gpac.replay(record, until="count > 20 and count != 22", show=["count"], trust=True)
    assert (again.stopped, again.svvs, again.time) == ("condition", {"count": ("21.0",)}, pytest.approx(0.021))
    assert gpac.replay(record, to="10 ms", show=["count"], trust=True).svvs == {"count": ("10.0",)}


def test_the_first_difference_of_other_code_is_named(record: Path, tmp_path: Path) -> None:
    folder = tmp_path / "changed"
    folder.mkdir()
    (folder / "counting.c").write_text(_BLOCK.format(jump=" + (self->n == 41.0 ? 0.5 : 0.0)"))
    difference = gpac.replay(record, modules=[folder / "counting.c"], trust=True).difference
    assert difference is not None
    assert (difference.block, difference.port, difference.source, difference.firing) == ("counts#1.counter", "y", "rtp0.fast", 42)
    assert (difference.recorded, difference.replayed) == (("42.0",), ("42.5",))


def test_the_command_says_what_was_found(record: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(record), "--trust", "--until", "count >= 7", "--show", "count"]) == 0
    assert "the condition held after firing 7 of source 'rtp0.fast'" in capsys.readouterr().out


def test_native_code_out_of_a_file_runs_only_where_it_is_trusted(
    record: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The record's module was never opened before: modules from a file are listed by their bytes."""
    [brought] = json.loads(_native.replay_modules(str(record)))
    assert brought["name"] == "counting" and brought["len"] > 1000 and len(brought["sha256"]) == 64
    for trust in (False, (), ["0" * 64]):
        with pytest.raises(gpac.CallError, match="contains native code, which a replay runs with all your privileges") as refused:
            gpac.replay(record, trust=trust)
        assert brought["sha256"] in str(refused.value) and "'counting'" in str(refused.value) and "--trust" in str(refused.value)
    assert gpac.replay(record, trust=[brought["sha256"]]).same
    assert main(["replay", str(record)]) == 1
    assert brought["sha256"] in capfd.readouterr().err
    for answer, status in (("y\n", 0), ("n\n", 1), ("", 1)):
        stdin = io.StringIO(answer)
        monkeypatch.setattr(stdin, "isatty", lambda: True)
        monkeypatch.setattr(sys, "stdin", stdin)
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
        assert main(["replay", str(record)]) == status
        asked = capfd.readouterr()
        assert "Run it? [y/N]" in asked.err and brought["sha256"] in asked.err
        assert ("all values equal to the recorded ones" in asked.out) == (status == 0)


def test_what_cannot_be_replayed_says_so(record: Path, tmp_path: Path) -> None:
    with pytest.raises(gpac.CallError, match=r"record '.*' does not exist"):
        gpac.replay(tmp_path / "none.mcap")
    with pytest.raises(gpac.CallError, match="it compares nothing"):
        gpac.replay(record, until="count", trust=True)
    with pytest.raises(gpac.CallError, match="the record has no SVV 'counts'; it has count"):
        gpac.replay(record, until="counts > 3", trust=True)
    (tmp_path / "other.c").write_text(_BLOCK.format(jump=""))
    with pytest.raises(gpac.CallError, match=r"no code module 'other'.*; it has counting"):
        gpac.replay(record, modules=[tmp_path / "other.c"], trust=True)
    (tmp_path / "text.mcap").write_text("hello")
    with pytest.raises(gpac.CallError, match="not an MCAP file"):
        gpac.replay(tmp_path / "text.mcap")
    with gpac.System("late", clock="virtual") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        with pytest.raises(gpac.InvalidState, match="already has interrupt sources"):
            cell.record(tmp_path / "late.mcap", replay=True)
        assert not (tmp_path / "late.mcap").exists()
        cell.record(tmp_path / "values.mcap").stop()
    with pytest.raises(gpac.CallError, match=r"nothing to replay.*replay=True"):
        gpac.replay(tmp_path / "values.mcap")


def test_mcap_itself_reads_it(record: Path) -> None:
    from mcap import reader

    with open(record, "rb") as file:
        read = reader.make_reader(file, validate_crcs=True)
        summary = read.get_summary()
        assert summary is not None and summary.statistics is not None
        messages = [(channel.topic, message.sequence) for _, channel, message in read.iter_messages(log_time_order=False)]
    assert [c.message_encoding for c in summary.channels.values() if c.topic == "/replay"] == ["opengpac.replay.1"]
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"lz4"}
    numbers = [number for topic, number in messages if topic == "/replay"]
    assert numbers == list(range(len(numbers)))
    assert len(numbers) >= gpac.replay(record, trust=True).firings


def test_one_file_has_the_values_too(record: Path) -> None:
    recorded = gpac.open_recording(record)
    assert list(recorded["count"]["value"]) == [0.0, *range(1, 101)]
    assert [entry["about"] for entry in recorded.log if entry["kind"] == "start"] == ["counts#1"]
    assert recorded.complete and not recorded.lost


def test_a_recording_may_end_before_its_system(tmp_path: Path) -> None:
    with gpac.System("recorded", clock="virtual") as cell:
        recording = cell.record(tmp_path / "run.mcap", replay=True)
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        verb = gpac.Verb(
            "wave",
            blocks={"wave": lib.signal_generator},
            instantiation_parameters={"y": "wave.y"},
            command_lists={"start": [activate("wave", every="1 ms")]},
        )
        verb.on(fast).asynch(cell.svv("y"))
        cell.advance("50 ms")
        recording.stop()
        cell.advance("50 ms")
    again = gpac.replay(tmp_path / "run.mcap", trust=True)
    assert (again.stopped, again.same) == ("end", True)
    assert 50 <= again.firings <= 52


def test_what_the_disk_was_too_slow_for_ends_the_replay_with_words(record: Path, tmp_path: Path) -> None:
    from mcap import reader, writer

    holed = tmp_path / "holed.mcap"
    with open(record, "rb") as source, open(holed, "wb") as file:
        out = writer.Writer(file, compression=writer.CompressionType.LZ4)
        out.start()
        channel = out.register_channel("/replay", "opengpac.replay.1", 0)
        for _, _, message in reader.make_reader(source).iter_messages("/replay", log_time_order=False):
            if not 60 <= message.sequence < 63:
                out.add_message(channel, message.log_time, message.data, message.publish_time, message.sequence)
        out.finish()
    again = gpac.replay(holed, trust=True)
    assert again.stopped == "unplayable" and 30 <= again.firings < 60
    assert "3 of its items are not in the file" in again.message


def test_a_record_that_is_cut_off_is_replayed_as_far_as_it_goes(record: Path, tmp_path: Path) -> None:
    from mcap import reader

    whole, cut = record.read_bytes(), tmp_path / "cut.mcap"
    with open(record, "rb") as file:
        summary = reader.make_reader(file).get_summary()
    assert summary is not None
    last = summary.chunk_indexes[-1]
    cut.write_bytes(whole[: last.chunk_start_offset + last.chunk_length + 10])
    again = gpac.replay(cut, trust=True)
    assert again.same and again.stopped == "end" and "file is incomplete" in again.message
    cut.write_bytes(whole[: summary.chunk_indexes[0].chunk_start_offset + 10])
    with pytest.raises(gpac.CallError, match="ends before there is anything to replay"):
        gpac.replay(cut, trust=True)


def test_what_runs_in_another_process_cannot_be_replayed_and_the_log_says_so(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with gpac.System("apart") as cell:
        cell.record(path, replay=True)
        cell.processor("rtp0").timer("fast", period="2 ms", priority=80)
        cell.processor("rtp1", process=True).timer("far", period="2 ms", priority=80)
        until(lambda: any("'rtp1.far' runs in another process" in entry["text"] for entry in cell.log()), "the log says it")
    again = gpac.replay(path, trust=True)
    assert again.stopped == "unplayable" and "runs in another process" in again.message


def test_a_device_that_was_lost_and_opened_again_is_so_in_the_replay(tmp_path: Path) -> None:
    path = tmp_path / "lost.mcap"
    with gpac.System("reopened", clock="virtual") as cell:
        cell.record(path, replay=True)
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        drives = rtp.physical_device("drives", gpac.drivers.loopback("x", initial=[0.25], fail_at="30 ms"), exchange=fast)
        reading = gpac.Verb(
            "reading",
            blocks={"push": lib.write_channel(u=1.0), "read": lib.read_channel},
            instantiation_parameters={"effort": "push.channel", "channel": "read.channel", "q": "read.y"},
            modes={"push.u": "asynchronous"},
            command_lists={"start": [activate("push", every="1 ms"), activate("read", every="1 ms")]},
        ).on(fast)
        q = cell.svv("q", unit="rad")
        for _ in range(2):
            with pytest.raises(gpac.Terminated, match="device_lost"):
                reading(drives["x"].effort, drives["x"].position, q)
            assert 0.27 < q.value < 0.29
            drives.reopen()
    again = gpac.replay(path, show=["q"], trust=True)
    assert (again.stopped, again.same, again.difference) == ("end", True, None)


_PADDED = """// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

TYPE(padded, "A flag and a count, with padding between them.", field(bool, flag), field(double, count), field(int16_t, last));

FUNCTION_BLOCK(padding, "Counts; the padding of its output differs between runs until it is stored.",
    out  (padded, y, "the count"),
    state(double, n, 0.0, "invocations so far"))
{
    unsigned char *bytes = (unsigned char *)&self->y;
    for (unsigned i = 0; i < sizeof self->y; i++) bytes[i] = (unsigned char)__builtin_ia32_rdtsc();
    self->n += 1;
    self->y.flag = true;
    self->y.count = self->n;
    self->y.last = 7;
    return OK;
}
"""


def test_the_padding_of_a_structure_is_no_difference(tmp_path: Path) -> None:
    (tmp_path / "padding.c").write_text(_PADDED)
    with gpac.System("recorded", clock="virtual") as cell:
        cell.record(tmp_path / "run.mcap", replay=True)
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        module = cell.download(tmp_path / "padding.c")
        verb = gpac.Verb(
            "counts",
            blocks={"padding": module["padding"]},
            cells={"y": "padding.y"},
            command_lists={"start": [activate("padding", every="1 ms")]},
        )
        counts = verb.on(fast).asynch()
        cell.advance("20 ms")
        counts.halt()
    again = gpac.replay(tmp_path / "run.mcap", trust=True)
    assert (again.same, again.difference) == (True, None) and again.firings >= 20
