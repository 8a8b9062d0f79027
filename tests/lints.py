# SPDX-License-Identifier: Apache-2.0
"""Runs a build with clippy as the compiler, and fails if it warned: `lints.py cargo test … --no-run`.

Cargo repeats the warnings of a crate in each later build of it, so this costs nothing after the same build.
"""

from __future__ import annotations

import subprocess
import sys


def run(command: list[str]) -> int:
    """Returns the build's exit status, or 1 if it succeeded with warnings. Passes its output on."""
    ended = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    sys.stderr.write(ended.stderr)
    return ended.returncode or int(any(line.startswith("warning") for line in ended.stderr.splitlines()))


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
