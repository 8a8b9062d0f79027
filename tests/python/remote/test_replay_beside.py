# SPDX-License-Identifier: Apache-2.0
"""A daemon replays a recording of its folder in parallel to its system: progress, equal runs, the first difference, permitted code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import until
from daemons import Daemon
from opengpac import _native, activate
from opengpac.cli import main

_BLOCK = """// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(counter, "Counts its invocations, with a jump.",
    out  (double, y,      "the count"),
    state(double, n, 0.0, "invocations so far"))
{{
    self->n += 1.0{jump};
    self->y = self->n;
    return OK;
}}
"""


def _recorded(cell: gpac.System, source: Path, path: str) -> None:
    """Records 100 ms of a counter in C."""
    with cell.record(path, replay=True):
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        module = cell.download(source)
        verb = gpac.Verb(
            "counts", blocks={"counter": module["counter"]}, instantiation_parameters={"y": "counter.y"},
            command_lists={"start": [activate("counter", every="1 ms")]},
        )  # fmt: skip
        counts = verb.on(fast).asynch(cell.svv("count", "double"))
        cell.advance("100 ms")
        counts.halt()
        counts.delete()


def _source(folder: Path, jump: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    source = folder / "counting.c"
    source.write_text(_BLOCK.format(jump=jump))
    return source


def _run(cell: gpac.System, present: bool = False) -> Any:
    """Replays the recording to its end; returns its final state."""
    calls = cell._alive()
    number = calls.replay("run.mcap", present=present)["replay"]
    until(lambda: not calls.replaying(number)["running"], "the replay ends")
    return calls.stop_replay(number)


def test_a_recording_is_run_again_beside_the_system(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, "virtual", "--records", str(tmp_path))
    try:
        with gpac.connect(daemon.url) as cell:
            _recorded(cell, _source(tmp_path), "run.mcap")
            equal = _run(cell)
            assert (equal["failure"], equal["found"]["stopped"], equal["found"]["same"]) == (None, "end", True)
            assert equal["firings"] >= 100 and equal["found"]["difference"] is None
            assert _run(cell, present=True)["found"]["same"]
            # The module has been replaced by another of that name; the record's own still runs, since the system has had it before.
            cell.download(_source(tmp_path / "changed", " + (self->n == 41.0 ? 0.5 : 0.0)"))
            assert _run(cell)["found"]["same"]
            differs = _run(cell, present=True)["found"]["difference"]
            assert (differs["svv"], differs["recorded"], differs["replayed"]) == ("count", ["42.0"], ["42.5"])
            assert (differs["block"], differs["port"], differs["number"]) == ("counts#1.counter", "y", 42)
            assert differs["time_ns"] == pytest.approx(42e6, abs=1e6)
            with pytest.raises(_native.Refused, match="there is no replay 99"):
                cell._alive().replaying(99)
    finally:
        daemon.stop()


def test_code_out_of_a_recording_runs_only_where_its_digest_is_trusted(tmp_path: Path) -> None:
    with gpac.System("recorded", clock="virtual") as cell:
        _recorded(cell, _source(tmp_path), str(tmp_path / "run.mcap"))
    daemon = Daemon(tmp_path, "virtual", "--records", str(tmp_path))
    try:
        with gpac.connect(daemon.url) as cell:
            refused = _run(cell)
            assert refused["found"] is None and "contains native code" in refused["failure"] and "SHA-256" in refused["failure"]
            digest = refused["failure"].split("SHA-256 ")[1][:64]
    finally:
        daemon.stop()
    trusting = Daemon(tmp_path, "virtual", "--records", str(tmp_path), "--trust", digest.upper())
    try:
        with gpac.connect(trusting.url) as cell:
            assert _run(cell)["found"]["same"]
            # A recording without external input has nothing to replay.
            with cell.record("plain.mcap"):
                cell.advance("1 ms")
            with pytest.raises(_native.Refused, match="nothing to replay"):
                cell._alive().replay("plain.mcap")
    finally:
        trusting.stop()


def test_a_digest_that_is_none_is_refused_at_the_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rts", "--socket", str(tmp_path / "cell.sock"), "--trust", "abc"]) == 1
    assert "'abc' is not a SHA-256 digest" in capsys.readouterr().err
