# SPDX-License-Identifier: Apache-2.0
"""`opengpac studio PROGRAM.py`, `opengpac rts --studio`, and the page of a daemon."""

from __future__ import annotations

import argparse
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

import opengpac as gpac
from browser import Browser
from daemons import Daemon, environment
from opengpac import _native
from opengpac.studio import server

PROGRAM = """
import sys
import opengpac as gpac
with gpac.System("line", clock="virtual") as cell:
    cell.svv("level", float).value = 2.0
    print("ready", *sys.argv[1:], flush=True)
    {last}
"""


class Running:
    """Command that serves a page, and its output."""

    def __init__(self, folder: Path, page: Path, *words: str, last: str = "") -> None:
        (folder / "line.py").write_text(PROGRAM.format(last=last))
        command = [sys.executable, "-m", "opengpac", words[0], "--page", str(page), *words[1:]]
        self.process = subprocess.Popen(command, cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().rstrip()

    def end(self, number: signal.Signals | None = signal.SIGINT) -> tuple[int, str]:
        """Ends the command; returns its status and standard error."""
        if number is not None:
            self.process.send_signal(number)
        _, said = self.process.communicate(timeout=300)
        return self.process.returncode, said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_program_goes_on_with_its_page_until_it_is_ended(page: Path, tmp_path: Path, number: signal.Signals) -> None:
    running = Running(tmp_path, page, "studio", "--no-browser", "line.py", "a", "b")
    try:
        browser = Browser(running.line().removeprefix("studio: "))
        assert running.line() == "ready a b"
        assert "keeps running; end it with Ctrl-C" in running.line()
        assert browser.call("read", names=["level"])["values"]["level"]["value"] == 2.0
    finally:
        ended = running.end(number)
    assert ended == (0, "")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((browser.host, browser.port))


def test_no_sleep_of_ours_delays_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python handles a signal that arrives just before a sleep only after that sleep, which must therefore be short."""
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        raise KeyboardInterrupt

    monkeypatch.setattr(time, "sleep", sleep)
    shown = server._Shown(argparse.Namespace(port=0, role="operate", edit=False, page=None, no_browser=True, program="line.py"))
    with gpac.System("line", clock="virtual") as cell, pytest.raises(KeyboardInterrupt):
        shown.left(cell)
    assert len(slept) == 1 and slept[0] <= 0.5


def test_a_program_that_fails_ends_its_page(page: Path, tmp_path: Path) -> None:
    running = Running(tmp_path, page, "studio", "--no-browser", "line.py", last="raise SystemExit(3)")
    assert running.line().startswith("studio: http://127.0.0.1:")
    assert running.end(None)[0] == 3


def test_a_page_that_was_not_built_is_said_before_the_program_runs(tmp_path: Path) -> None:
    running = Running(tmp_path, tmp_path / "none", "studio", "line.py")
    assert running.line() == ""
    status, said = running.end(None)
    assert status == 1 and "make page" in said


def test_a_daemon_prints_the_address_of_its_page(page: Path, tmp_path: Path) -> None:
    running = Running(tmp_path, page, "rts", "--clock", "virtual", "--socket", str(tmp_path / "s"), "--studio", "--studio-role", "observe")
    try:
        assert running.line() == f"listening on unix://{tmp_path / 's'}"
        assert running.line().startswith("listening on http://127.0.0.1:")
        browser = Browser(running.line().removeprefix("studio: "))
        assert browser.fetch("GET", "/")[0] == 200
        assert browser.refused("emergency_stop", reason="x") == "NotAllowed"
    finally:
        ended = running.end()
    assert ended == (0, "")


def test_what_makes_no_sense_is_refused(page: Path, tmp_path: Path) -> None:
    running = Running(tmp_path, page, "rts", "--studio-role", "observe")
    status, said = running.end(None)
    assert status == 1 and "add --studio" in said


def test_the_page_of_a_system_elsewhere_is_that_of_its_daemon(page: Path, tmp_path: Path) -> None:
    tokens = tmp_path / "tokens.json"
    token = _native.token_new(tokens, "panel", "operate")
    daemon = Daemon(tmp_path, "virtual", "--listen", "127.0.0.1:0", "--tokens", str(tokens), "--page", str(page))
    try:
        with gpac.connect(daemon.urls[1], name="panel", token=token) as cell:
            there = cell.studio()
            assert there.url == f"{daemon.urls[1]}/#token={token}"
            assert Browser(there.url).fetch("GET", "/")[0] == 200
            there.stop()
            assert Browser(cell.studio().url).fetch("GET", "/")[0] == 200
        with gpac.connect(daemon.url, name="local") as cell, pytest.raises(gpac.NotAllowed, match="--studio"):
            cell.studio()
    finally:
        daemon.stop()


def test_a_daemon_without_a_page_is_named(tmp_path: Path) -> None:
    tokens = tmp_path / "tokens.json"
    token = _native.token_new(tokens, "panel", "operate")
    daemon = Daemon(tmp_path, "virtual", "--listen", "127.0.0.1:0", "--tokens", str(tokens))
    try:
        with gpac.connect(daemon.urls[1], name="panel", token=token) as cell:
            if (Path(gpac.__file__).parent / "studio_page" / "index.html").is_file():
                assert cell.studio().url.startswith(daemon.urls[1])
            else:
                with pytest.raises(gpac.NotAllowed, match="does not serve a page"):
                    cell.studio()
    finally:
        daemon.stop()
