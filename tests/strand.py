# SPDX-License-Identifier: Apache-2.0
"""Runs one strand of `make test` and notes its start, its end and its processor time: `strand.py FILE NAME COMMAND …`.

The note is a line of JSON in the file; `tests/closing.py` draws and counts the strands.
"""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path


def run(notes: Path, name: str, command: list[str]) -> int:
    """Returns the command's exit status; 128 plus the signal if a signal ended it."""
    began = time.time()
    # A signal to this process is meant for the command: it waits until the command runs. Ctrl-C reaches the command by itself.
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
    process = subprocess.Popen(command, preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM]))
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
    while True:
        try:
            status = process.wait()
            break
        except KeyboardInterrupt:
            continue
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    note = {"strand": name, "began": began, "ended": time.time(), "processor_s": used.ru_utime + used.ru_stime, "status": status}
    notes.parent.mkdir(exist_ok=True)
    with notes.open("a") as out:
        out.write(json.dumps(note) + "\n")
    return status if status >= 0 else 128 - status


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), sys.argv[2], sys.argv[3:]))
