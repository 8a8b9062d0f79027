# SPDX-License-Identifier: Apache-2.0
"""Runs a command with its output in a file, and shows the file as it grows: `logged.py FILE COMMAND …`.

A pipe would be open as long as anything that the command left behind lives; a file keeps nobody waiting.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import BinaryIO

LOOK_S = 0.2


def run(log: Path, command: list[str]) -> int:
    """The command's exit status; 128 and the signal where one ended it."""
    with log.open("wb") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    with log.open("rb") as said:
        while True:
            try:
                status = process.wait(LOOK_S)
            except subprocess.TimeoutExpired:
                show(said)
            except KeyboardInterrupt:
                # The command has got it too, and ends in its own way.
                continue
            else:
                show(said)
                return status if status >= 0 else 128 - status


def show(said: BinaryIO) -> None:
    """What has come since the last time."""
    sys.stdout.buffer.write(said.read())
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), sys.argv[2:]))
