# SPDX-License-Identifier: Apache-2.0
"""Test counterpart in a separate process, which reads lines of JSON and answers each with one line."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
from collections.abc import Mapping
from types import TracebackType
from typing import Any, Self

from ...errors import CallError, DeviceFailed, refuse
from ...system import processes

ANSWER_S = 60.0
"""Time limit for an answer, s: a safety net for busy machines."""
END_S = 10.0
"""Time limit for the process to exit by itself before it is killed, s."""


class EmulatedBus:
    """An emulated bus in a separate process. The process ends on `close()`, at the end of a `with` block, or when the program exits.

    `program` is the main program of the process, `what` is its name in error messages, and `options` is the first line sent to it.
    """

    def __init__(self, program: str, what: str, options: Mapping[str, Any]) -> None:
        self._what = what
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self._process = subprocess.Popen(processes.command(program), **pipes)
        self._say(options)

    def _say(self, what: Mapping[str, Any]) -> dict[str, Any]:
        stdin, stdout, stderr = self._process.stdin, self._process.stdout, self._process.stderr
        assert stdin is not None and stdout is not None and stderr is not None
        line = ""
        with contextlib.suppress(OSError):
            stdin.write(json.dumps(what) + "\n")
            stdin.flush()
            answers = select.poll()
            answers.register(stdout, select.POLLIN)
            if not answers.poll(ANSWER_S * 1e3):
                self.close()
                refuse(DeviceFailed, f"{self._what} did not answer within {ANSWER_S:g} s", "start a new one")
            line = stdout.readline()
        if not line:
            reason = stderr.read().strip() or "its process has ended"
            self.close()
            refuse(DeviceFailed, f"{self._what} does not answer: {reason}", "start a new one")
        answer = json.loads(line)
        if "refused" in answer:
            refuse(CallError, f"{self._what} refused {dict(what)}: {answer['refused']}", "use a call that it supports")
        return answer

    def _shown(self) -> dict[str, Any]:
        return self._say({"do": "show"})

    def lose(self, frames: int) -> None:
        """Drops the next `frames` answers."""
        self._say({"do": "lose", "frames": frames})

    def spoil(self, frames: int) -> None:
        """Corrupts the next `frames` answers: on EtherCAT by a bit error that the checksum does not detect, on CANopen by truncation."""
        self._say({"do": "spoil", "frames": frames})

    def close(self) -> None:
        """Ends the process."""
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                # Unwritten data no longer matter.
                with contextlib.suppress(OSError):
                    stream.close()
        # A copy of its input in a forked process may keep it from ending.
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()
