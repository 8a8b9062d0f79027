# SPDX-License-Identifier: Apache-2.0
"""Runs a command with its output in a file, and shows the file as it grows: `logged.py FILE COMMAND …`.

A pipe would stay open as long as any process that the command left behind; with a file there is nothing to wait for.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import BinaryIO

LOOK_S = 0.2


def run(log: Path, command: list[str]) -> int:
    """Returns the command's exit status; 128 plus the signal if a signal ended it."""
    with log.open("wb") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    with log.open("rb") as said:
        while True:
            try:
                status = process.wait(LOOK_S)
            except subprocess.TimeoutExpired:
                show(said)
            except KeyboardInterrupt:
                # The command has received the signal too, and ends in its own way.
                continue
            else:
                show(said)
                return status if status >= 0 else 128 - status


def show(said: BinaryIO) -> None:
    """Shows the output since the last call."""
    sys.stdout.buffer.write(said.read())
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), sys.argv[2:]))
