# SPDX-License-Identifier: Apache-2.0
"""The conformance kit on a driver in Python."""

from __future__ import annotations

import faulthandler
import subprocess
import sys

from daemons import environment

LIMIT_S = 1800


def checked(*words: str) -> str:
    """Returns the output of `opengpac driver check` with these arguments; checks that it passes.

    Each check opens the driver in a process of its own, which takes long on a busy machine: so the kit has its own time limit, not
    that of a test.
    """
    faulthandler.cancel_dump_traceback_later()
    command = [sys.executable, "-m", "opengpac", "driver", "check", "--machine-is-safe", *words, "age_max=60 s", "--exchanges", "200"]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
