# SPDX-License-Identifier: Apache-2.0
"""`opengpac rts` and `opengpac token`: a system as a daemon, from its first line to its last."""

from __future__ import annotations

import http.client
import json
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import cli


class Daemon:
    """Daemon in a folder of its own, and requests to it."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.socket = folder / "s"
        command = [sys.executable, "-m", "opengpac", "rts", "--socket", str(self.socket), *words]
        self.process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.first = self.process.stdout.readline()

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        """Makes a request; returns its status and answer."""
        connection = http.client.HTTPConnection("localhost")
        connection.sock = socket.socket(socket.AF_UNIX)
        connection.sock.connect(str(self.socket))
        connection.request(method, path, json.dumps(body) if body is not None else None, headers)
        answer = connection.getresponse()
        said = json.loads(answer.read())
        connection.close()
        return answer.status, said

    def end(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, str]:
        """Ends the daemon; returns its status and its standard error."""
        self.process.send_signal(number)
        _, said = self.process.communicate(timeout=300)
        return self.process.returncode, said


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_daemon_says_where_it_listens_and_ends_in_order(tmp_path: Path, number: signal.Signals) -> None:
    daemon = Daemon(tmp_path, "--name", "press", "--clock", "virtual")
    try:
        assert daemon.first == f"listening on unix://{daemon.socket}\n"
        status, version = daemon.ask("GET", "/v1/version")
        assert (status, version["system"], version["clock"]) == (200, "press", "virtual")
    finally:
        status, said = daemon.end(number)
    assert (status, said) == (0, "")
    assert not daemon.socket.exists()


def test_a_daemon_that_is_hung_up_goes_on_with_its_files_opened_again(tmp_path: Path) -> None:
    audit = tmp_path / "audit.jsonl"
    daemon = Daemon(tmp_path, "--clock", "virtual", "--audit", str(audit))
    try:
        stop = {"reason": "\x1b[2Jdoor"}
        assert daemon.ask("POST", "/v1/call/emergency_stop", stop)[0] == 200
        audit.rename(tmp_path / "audit.old")
        daemon.process.send_signal(signal.SIGHUP)
        assert daemon.process.stderr is not None
        assert daemon.process.stderr.readline() == "the audit file, the tokens and the TLS files were reopened\n"
        assert daemon.ask("POST", "/v1/call/emergency_stop", stop)[0] == 200
        assert [json.loads(line)["call"] for line in audit.read_text().splitlines()] == ["emergency_stop"]
        entries = daemon.ask("POST", "/v1/call/log", {"since": 0})[1]["result"]
        assert all("\x1b" not in entry["text"] for entry in entries), "nothing in the log drives a terminal"
        assert any("\ufffd[2Jdoor" in entry["text"] for entry in entries)
    finally:
        status, _ = daemon.end()
    assert status == 0


PROGRAM = """
import opengpac as gpac
from opengpac import activate
cell = gpac.System("line", clock="virtual")
fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
y = cell.svv("y")
wave = gpac.Verb("wave", blocks={"w": gpac.library.signal_generator}, instantiation_parameters={"y": "w.y"}, if_cut_off="continue",
                 command_lists={"start": [activate("w", every="1 ms")]})
running = wave.on(fast).asynch(y=y)
assert __name__ == "opengpac.rts"
"""


def test_a_program_makes_the_system_that_is_served(tmp_path: Path) -> None:
    (tmp_path / "line.py").write_text(PROGRAM)
    daemon = Daemon(tmp_path, "line.py")
    try:
        assert daemon.first.startswith("listening on"), daemon.end()
        _, version = daemon.ask("GET", "/v1/version")
        _, there = daemon.ask("POST", "/v1/call/statistics")
    finally:
        daemon.end()
    assert version["system"] == "line"
    assert [(i["verb"], i["state"]) for i in there["result"]["instances"]] == [("wave", "running")]


@pytest.mark.parametrize(
    ("program", "words", "refused"),
    [
        ("", ["p.py"], "leaves 0 systems open"),
        ("import opengpac as gpac\nwith gpac.System('a', clock='virtual') as a: pass\n", ["p.py"], "leaves 0 systems open"),
        ("", ["--name", "x", "p.py"], "--name cannot be combined with"),
        ("", ["--listen", "0.0.0.0:0"], "has no TLS"),
        ("", ["--listen", "127.0.0.1:0"], "has no authentication"),
        ("", ["--tokens", "none.json"], "opengpac token new"),
    ],
)
def test_what_cannot_be_served_is_refused_with_the_remedy(tmp_path: Path, program: str, words: list[str], refused: str) -> None:
    (tmp_path / "p.py").write_text(program)
    command = [sys.executable, "-m", "opengpac", "rts", "--socket", "s", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1 and refused in done.stderr and "Traceback" not in done.stderr, done.stderr


def test_tokens_are_made_listed_and_revoked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)

    def said(*words: str) -> tuple[int, str]:
        status = cli.main(["token", *words])
        printed = capsys.readouterr()
        return status, printed.out + printed.err

    status, token = said("new", "--name", "panel", "--role", "operate", "--days", "90")
    assert status == 0 and token.startswith("gpac_")
    assert (tmp_path / "tokens.json").stat().st_mode & 0o777 == 0o600
    assert token.strip() not in (tmp_path / "tokens.json").read_text()
    status, twice = said("new", "--name", "panel", "--role", "observe")
    assert status == 1 and "there is already a token 'panel'" in twice
    assert said("list") == (0, "panel                operate    token        valid\n")
    assert said("revoke", "panel") == (0, "token 'panel' has been revoked\n")
    assert said("revoke", "panel") == (1, "there is no valid token 'panel'\n")
    assert said("list")[1].endswith("revoked\n")
    daemon = Daemon(tmp_path, "--clock", "virtual", "--tokens", "tokens.json")
    try:
        status, answer = daemon.ask("GET", "/v1/version", Authorization=f"Bearer {token.strip()}")
    finally:
        daemon.end()
    assert status == 401 and "revoked" in answer["errors"][0]["message"]


def test_a_word_that_is_no_policy_is_refused() -> None:
    with pytest.raises(gpac.DefinitionError, match="if_cut_off= of verb 'v' must be a policy, not 'stop'"):
        gpac.Verb(
            "v",
            blocks={"w": gpac.library.signal_generator},
            instantiation_parameters={"y": "w.y"},
            command_lists={"start": [gpac.activate("w", every="1 ms")]},
            if_cut_off="stop",
        )
