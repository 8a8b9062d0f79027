# SPDX-License-Identifier: Apache-2.0
"""`opengpac top`: against a real daemon, on a terminal and without one; and the differences between two samples."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import subprocess
import sys
import termios
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from daemons import PATIENCE_S, Daemon, environment
from opengpac import activate, cli
from opengpac import library as lib
from opengpac.top import url_of
from opengpac.top.board import View, board
from opengpac.top.look import Look
from opengpac.top.screen import Screen

COMMAND = [sys.executable, "-m", "opengpac", "top"]


def wave() -> gpac.Verb[..., Any]:
    return gpac.Verb(
        "wave",
        blocks={"wave": lib.signal_generator, "gain": lib.gain},
        instantiation_parameters={"y": ["gain.y"]},
        cells={"u": ["wave.y", "gain.u"]},
        command_lists={"start": [activate("wave", every="1 ms"), activate("gain")]},
    )


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    """Yields a daemon in which a verb runs, in real time."""
    served = Daemon(tmp_path, "monotonic")
    try:
        with gpac.connect(served.url) as cell:
            fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
            wave().on(fast).named("moving").asynch(cell.svv("y"))
        yield served
    finally:
        served.stop()


def test_without_a_terminal_it_prints_once(daemon: Daemon) -> None:
    ran = subprocess.run([*COMMAND, daemon.url, "--every", "0.2"], capture_output=True, text=True, env=environment(), timeout=PATIENCE_S)
    assert ran.returncode == 0, ran.stderr
    for word in ("processors", "rtp0.fast", "moving.wave", "library.gain", "verb instances", "1 ms"):
        assert word in ran.stdout
    assert "\x1b" not in ran.stdout


def test_as_json_it_has_loads_rates_and_block_times(daemon: Daemon) -> None:
    ran = subprocess.run([*COMMAND, daemon.url, "--json", "--every", "0.2"], capture_output=True, text=True, env=environment(), check=True)
    told = json.loads(ran.stdout)
    (source,) = told["sources"]
    assert (told["system"], source["name"], source["period_ns"], source["kind"]) == ("cell", "rtp0.fast", 1_000_000, "timer")
    assert source["load"] > 0 and source["firings_per_s"] > 0
    assert {b["label"] for b in told["blocks"]} == {"wave", "gain"}
    assert [i["name"] for i in told["instances"]] == ["moving"] and told["processors"][0]["load"] == source["load"]


def _read_until(terminal: int, wanted: str, seen: str = "") -> str:
    """Returns the terminal's output, without its colours, up to `wanted`."""
    while wanted not in (plain := re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen)):
        assert select.select([terminal], [], [], PATIENCE_S)[0], f"'{wanted}' does not come: {plain[-2000:]}"
        seen += os.read(terminal, 65536).decode(errors="replace")
    return seen


def test_on_a_terminal_keys_are_served_and_it_leaves_the_terminal_as_it_was(daemon: Daemon) -> None:
    terminal, its = pty.openpty()
    before = termios.tcgetattr(its)
    termios.tcsetwinsize(its, (50, 160))
    words = [*COMMAND, daemon.url, "--every", "0.2"]
    with subprocess.Popen(words, stdin=its, stdout=its, stderr=its, env=environment(TERM="xterm-256color")) as process:
        try:
            _read_until(terminal, "blocks by time")
            os.write(terminal, b"s")
            _read_until(terminal, "blocks by mean")
            os.write(terminal, b"fgain\r")
            _read_until(terminal, "filter: gain")
            os.write(terminal, b"p")
            _read_until(terminal, "paused")
            os.write(terminal, b"q")
            while process.poll() is None:
                if select.select([terminal], [], [], 0.1)[0]:
                    os.read(terminal, 65536)
            assert process.returncode == 0
            assert termios.tcgetattr(its) == before
        finally:
            process.kill()
    os.close(its)
    os.close(terminal)


def test_ctrl_c_ends_it_in_order(daemon: Daemon) -> None:
    terminal, its = pty.openpty()
    before = termios.tcgetattr(its)
    with subprocess.Popen(
        [*COMMAND, daemon.url], stdin=its, stdout=its, stderr=its, env=environment(TERM="xterm"), start_new_session=True
    ) as process:
        try:
            _read_until(terminal, "interrupt sources")
            process.send_signal(2)
            said = ""
            while process.poll() is None:
                if select.select([terminal], [], [], 0.1)[0]:
                    said += os.read(terminal, 65536).decode(errors="replace")
            assert process.returncode == 0 and "Traceback" not in said
            assert termios.tcgetattr(its) == before
        finally:
            process.kill()
    os.close(its)
    os.close(terminal)


def test_daemons_of_this_user_are_found_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "opengpac"
    folder.mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert cli.main(["top"]) == 1
    assert "this user runs no daemon; start one with opengpac rts" in capsys.readouterr().err
    served = Daemon(folder)
    try:
        # A socket left behind by a killed daemon does not count as one.
        (folder / "dead.sock").touch()
        assert url_of(None, None) == url_of("cell", None) == url_of(None, "cell") == served.url
        assert url_of("http://127.0.0.1:1", None) == "http://127.0.0.1:1"
        assert cli.main(["top", "--name", "sell"]) == 1
        assert "this user runs no daemon named 'sell'" in capsys.readouterr().err
        os.link(served.socket, folder / "other.sock")
        assert cli.main(["top"]) == 1
        said = capsys.readouterr().err
        assert "this user runs 2 daemons: cell (" in said and "choose one with --name" in said
        (folder / "other.sock").unlink()
    finally:
        served.stop()


@pytest.mark.parametrize("every", ["0", "-1", "61", "nan"])
def test_an_interval_out_of_range_is_refused(every: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["top", "--every", every]) == 1
    assert "0.1 to 60 s" in capsys.readouterr().err


def _look(now_s: float, duration_ns: int, blocks: list[dict[str, Any]], firings: int = 0) -> Look:
    source = {
        "firings": firings, "overruns": 0, "late": 0, "faults": 0, "stopped": False, "rights_missing": [], "jitter_bins": [0] * 32,
        "jitter_median_ns": 0, "jitter_max_ns": 900, "duration_sum_ns": duration_ns, "duration_max_ns": 5_000, "steps": 1, "blocks": blocks,
    }  # fmt: skip
    statistics = {
        "now_s": now_s, "mode": "automatic", "paused": False, "emergency": None, "instances": [], "devices": {"elbow": "fault"},
        "physical_devices": {"plant": {"lost": None}}, "sources": {"rtp0.fast": source},
    }  # fmt: skip
    about = {"processor": "rtp0", "kind": {"timer": {"period_ns": 1_000_000}}, "priority": 80}
    configuration = {"processors": {"rtp0": {"core": 1, "supervisor": True}}, "sources": {"rtp0.fast": about}}
    return Look(statistics, configuration, [])


def _block(label: str, samples: int, mean_ns: float, number: int, max_ns: int = 9_000) -> dict[str, Any]:
    return {
        "instance": "move#1", "label": label, "block": f"library.{label}", "samples": samples, "mean_ns": mean_ns, "last_ns": 1,
        "max_ns": max_ns, "number": number,
    }  # fmt: skip


def test_two_looks_tell_what_happened_between_them() -> None:
    before = _look(10.0, 1_000_000_000, [_block("pid", 10, 1_000, 1_000), _block("planner", 1, 80_000, 1)], 1_000)
    now = _look(12.0, 1_500_000_000, [_block("pid", 20, 2_000, 3_000), _block("planner", 1, 80_000, 1)], 3_000)
    (source,) = now.sources(before)
    assert (source["load"], source["firings_per_s"]) == (0.25, 1_000)
    pid, planner = now.blocks(before)
    assert (pid["mean_ns"], pid["invocations_per_s"], pid["used"]) == pytest.approx((3_000, 1_000, 0.003))
    assert (planner["mean_ns"], planner["used"]) == (80_000, 0.0), "it did not run, and its last known time stays"
    assert now.processors(before)[0]["load"] == 0.25


def test_where_no_time_has_passed_there_is_no_load() -> None:
    look = _look(5.0, 100, [])
    assert look.sources(look)[0]["load"] is None
    assert "-" in repr(board(look, look))


def test_a_view_sorts_filters_and_keeps_to_its_room() -> None:
    blocks = [_block(f"b{n:02}", 1, 100 * n, 1, 9_000 - n) for n in range(40)]
    look = _look(5.0, 100, blocks)

    def first(sort: str) -> str:
        table = next(t for t in board(look, None, View(sort, rows=30)).tables if t.title.startswith("blocks"))
        assert len(table.rows) < 30 and "of 40" in table.title
        return table.rows[0][0]

    assert [first(sort) for sort in ("mean", "max", "name")] == ["move#1.b39", "move#1.b00", "move#1.b00"]
    filtered = repr(board(look, None, View(filter="B07")))
    assert "b07" in filtered and "b08" not in filtered and "elbow" not in filtered


def test_keys_change_the_view() -> None:
    class Still:
        every_s = 1.0

        def look(self) -> tuple[Look, None]:
            return _look(5.0, 100, []), None

    view = View()
    screen = Screen(Still(), view, "cell")  # type: ignore[arg-type]
    assert all(screen.take(key) for key in "sspfpi\x7fq\r")
    assert (view.sort, view.filter) == ("max", "pq"), "while a filter is typed, q is a letter"
    assert all(screen.take(key) for key in "fabc\x1b") and view.filter == ""
    assert not screen.take("q")
