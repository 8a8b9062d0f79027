# SPDX-License-Identifier: Apache-2.0
"""On loopback every user of a machine can reach a listening system: to join, one needs the secret of its user, or another one that was
issued."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import opengpac as gpac
from daemons import PATIENCE_S, environment
from joining import LISTENER, Joining, free_endpoint

TOKEN = "a-token-of-the-tests"
NOBODY = 65534


AS_NOBODY = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]


@cache
def may_be_another_user() -> bool:
    """Returns whether this user may become another one who can read this project: a clone may be in a folder that only its owner can
    read."""
    if os.geteuid() != 0:
        return False
    tried = [*AS_NOBODY, sys.executable, "-c", "import opengpac"]
    return subprocess.run(tried, cwd="/", stdin=subprocess.DEVNULL, capture_output=True, check=False).returncode == 0


def stranger(endpoint: str, name: str, *options: str, user: bool = False) -> subprocess.Popen[str]:
    """Starts `opengpac join` with a private folder for the user's files; with `user` as another user."""
    folder = tempfile.mkdtemp(prefix="opengpac-stranger-")
    if user:
        os.chown(folder, NOBODY, NOBODY)
    join = [sys.executable, "-m", "opengpac", "join", "--system", "line", "--at", endpoint, "--name", name, *options]
    return subprocess.Popen(
        [*(AS_NOBODY if user else ()), *join],
        env=environment(XDG_RUNTIME_DIR=folder, HOME=folder),
        cwd="/",
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def test_another_user_is_not_let_in_and_this_one_is(
    tmp_path: Path, listening: gpac.System, endpoint: str, joins: Callable[..., Joining]
) -> None:
    """As another user if that is possible; otherwise with another secret, the only difference of another user."""
    (tmp_path / "token").write_text(TOKEN)
    strangers = [
        stranger(endpoint, "other", user=may_be_another_user()),
        stranger(endpoint, "guess", "--token-file", str(tmp_path / "token")),
    ]
    joins("friend")
    listening.processor("friendly", host="friend").timer("t", period="10 ms", priority=50)
    for one, said in [(one, one.communicate(timeout=PATIENCE_S)[0]) for one in strangers]:
        assert one.returncode == 1 and "it belongs to another user" in said and "Traceback" not in said, said


def test_a_token_lets_another_user_in_on_loopback(tmp_path: Path) -> None:
    (tmp_path / "token").write_text(TOKEN + "\n")
    endpoint = free_endpoint()
    with gpac.System("line", progress=False) as cell:
        cell.listen(endpoint, LISTENER, token=TOKEN)
        invited = stranger(endpoint, "invited", "--token-file", str(tmp_path / "token"))
        try:
            cell.processor("far", host="invited").timer("t", period="10 ms", priority=50)
        finally:
            invited.terminate()
            said, _ = invited.communicate(timeout=PATIENCE_S)
    assert "has left" in said, said
