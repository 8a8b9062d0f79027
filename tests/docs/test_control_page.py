# SPDX-License-Identifier: Apache-2.0
"""The page of the control interface: its requests work against a daemon, and its table of roles equals that of the code."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

from listings import ROOT, assert_prints, listings

from opengpac import _native

PAGE = ROOT / "docs" / "control.md"


def test_the_requests_of_the_page_are_answered_as_it_says(tmp_path: Path) -> None:
    paths = [str(Path(_native.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    words = [sys.executable, "-m", "opengpac", "rts", "--clock", "virtual", "--socket", "cell.sock"]
    daemon = subprocess.Popen(words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True)
    assert daemon.stdout is not None
    try:
        assert daemon.stdout.readline() == "listening on unix://cell.sock\n"
        page = list(listings(PAGE))
        asked = next(listing for listing in page if "curl" in listing.words)
        answers = next(listing for listing in page if "answers" in listing.words)
        done = subprocess.run(["sh", "-e"], input=asked.text, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert_prints(answers, answers.text, done.stdout)
    finally:
        daemon.send_signal(signal.SIGTERM)
        status = daemon.wait(timeout=300)
        daemon.stdout.close()
    assert status == 0
    assert not (tmp_path / "cell.sock").exists()


def test_the_journal_of_the_page_is_played(tmp_path: Path) -> None:
    paths = [str(Path(_native.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
    command = tmp_path / "opengpac"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m opengpac "$@"\n')
    command.chmod(0o700)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    page = list(listings(PAGE))
    done_by = next(listing for listing in page if "journal" in listing.words)
    prints = next(listing for listing in page if "journaled" in listing.words)
    done = subprocess.run(
        ["sh", "-e"], input=done_by.text + "wait\n", cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=True
    )
    assert_prints(prints, prints.text, done.stdout)
    assert not (tmp_path / "cell.sock").exists()


def test_the_table_of_roles_is_that_of_the_code() -> None:
    schemas = json.loads((ROOT / "crates" / "control" / "schemas" / "control-v1.json").read_text())
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", PAGE.read_text(), re.MULTILINE)
    shown = {name: role for role, names in rows for name in re.findall(r"`([a-z_]+)`", names)}
    roles = ("observe", "operate", "configure", "download")
    assert {n: r for n, r in shown.items() if r in roles} == {name: call["role"] for name, call in schemas["calls"].items()}
