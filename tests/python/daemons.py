# SPDX-License-Identifier: Apache-2.0
"""Real-time systems as daemons, for tests: real processes, which must end in order and leave nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from opengpac import _native

PATIENCE_S = 180
"""Time limit of a daemon's end: a hang fails a test, slowness does not."""


def environment(**more: str) -> dict[str, str]:
    """Returns the environment of a process that uses this package."""
    paths = [str(Path(_native.__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), "PYTHONDONTWRITEBYTECODE": "1", **more}


class Daemon:
    """Daemon `opengpac rts` with a Unix socket in a folder; `url` is its address."""

    def __init__(self, folder: Path, clock: str = "virtual", *options: str) -> None:
        self.folder = folder
        self.socket = folder / "cell.sock"
        words = ["rts", "--name", "cell", "--socket", str(self.socket), "--clock", clock, *options]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "opengpac", *words], env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.killed = False
        self.said: list[str] = []
        try:
            self.urls = self._addresses(1 + options.count("--listen"))
        except BaseException:
            self.kill()
            raise
        self.url = f"unix://{self.socket}"

    def _addresses(self, count: int) -> list[str]:
        """Returns the addresses that the daemon prints."""
        found: list[str] = []
        assert self.process.stdout is not None
        while len(found) < count:
            line = self.process.stdout.readline()
            assert line, f"the daemon does not say where it listens: {self.said}"
            self.said.append(line.rstrip())
            if line.startswith("listening on "):
                found.append(line.removeprefix("listening on ").strip())
        return found

    def kill(self) -> None:
        """Kills the daemon, as a fault would."""
        self.process.kill()
        self.process.wait()
        # Processes that outlive the daemon hold its output too, so its end of file never comes.
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.killed = True

    def stop(self) -> None:
        """Ends the daemon in order: with status 0, its socket removed."""
        if self.killed:
            return
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        rest, _ = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0, "\n".join([*self.said, rest])
        assert not self.socket.exists(), "it left its socket behind"
