# SPDX-License-Identifier: Apache-2.0
"""Runs a build whose compiler is clippy, and fails where it warned: `lints.py cargo test … --no-run`.

What the lints said of a crate cargo says again with every later build of it, so that this costs nothing behind a build of the same.
"""

from __future__ import annotations

import subprocess
import sys


def run(command: list[str]) -> int:
    """The build's exit status, or 1 where it ended well and warned. Its words are passed on."""
    ended = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    sys.stderr.write(ended.stderr)
    return ended.returncode or int(any(line.startswith("warning") for line in ended.stderr.splitlines()))


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
