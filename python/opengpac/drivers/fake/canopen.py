# SPDX-License-Identifier: Apache-2.0
"""A bus of CANopen that is only a program."""

from __future__ import annotations

import contextlib
import json
import secrets
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any

from ... import processes
from ...errors import CallError, DeviceFailed, refuse
from ...given import taking


@dataclass(frozen=True)
class CanOpenDrive:
    """How an emulated drive is."""

    node: int
    """Its number on the bus."""
    state: str
    """`operational`, `pre-operational`, `stopped`, `off`."""
    drive: str
    """The state of its axis: `operation enabled`, `fault`."""
    position: int
    """Where its axis is, counts."""
    target: int
    """Where its axis is to be, counts."""
    mode: int
    """8 position, 9 velocity, 10 torque."""
    error: int
    """Its error code, 0x603F; 0 where it has none."""


class CanOpenBus:
    """Emulated drives on a bus, in a process of their own; `canopen()` starts one. It ends with `close()`, a `with`, or its program."""

    interface: str
    """What a controller opens: `local:NAME`."""

    def __init__(self, drives: list[dict[str, Any]]) -> None:
        self.interface = f"local:{secrets.token_hex(8)}"
        command = processes.command("run_canopen_bus")
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self._say({"interface": self.interface, "drives": drives})

    def _say(self, what: Mapping[str, Any]) -> dict[str, Any]:
        stdin, stdout, stderr = self._process.stdin, self._process.stdout, self._process.stderr
        assert stdin is not None and stdout is not None and stderr is not None
        line = ""
        with contextlib.suppress(OSError):
            stdin.write(json.dumps(what) + "\n")
            stdin.flush()
            line = stdout.readline()
        if not line:
            reason = stderr.read().strip() or "its process has ended"
            self.close()
            refuse(DeviceFailed, f"the emulated bus does not answer: {reason}", "start another one")
        answer = json.loads(line)
        if "refused" in answer:
            refuse(CallError, f"the emulated bus refused {dict(what)}: {answer['refused']}", "ask for what it can do")
        return answer

    def drives(self) -> list[CanOpenDrive]:
        """How each drive is now, in their order."""
        return [CanOpenDrive(**drive) for drive in self._say({"do": "show"})["drives"]]

    @property
    def frames(self) -> int:
        """Frames that have come from controllers."""
        return self._say({"do": "show"})["frames"]

    def power(self, node: int, on: bool) -> None:
        """Switches the voltage of a drive. With it comes a drive that knows nothing, its axis where it was."""
        self._say({"do": "power", "node": node, "on": on})

    def lose(self, frames: int) -> None:
        """The next frames of drives do not come."""
        self._say({"do": "lose", "frames": frames})

    def spoil(self, frames: int) -> None:
        """The next frames of drives are shorter than they should be."""
        self._say({"do": "spoil", "frames": frames})

    def fail(self, node: int, error: int = 0x7121) -> None:
        """A drive finds something wrong: an error code of CiA 402, here that its motor is blocked. It sends an emergency."""
        self._say({"do": "fail", "node": node, "error": error})

    def bus_off(self) -> None:
        """The adapter of the controller reports that it has left the bus."""
        self._say({"do": "bus_off"})

    def close(self) -> None:
        """Ends it."""
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                # What was not written any more is nobody's.
                with contextlib.suppress(OSError):
                    stream.close()
        self._process.wait()

    def __enter__(self) -> CanOpenBus:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


@taking
def canopen(*drives: str | Mapping[str, Any]) -> CanOpenBus:
    """An emulated bus: drives by CiA 402 with motors that follow, as `gpac.drivers.canopen` sees them.

    A drive is its name, with the nodes 1, 2, … in their order, or `{"name": "x", "node": 5, "position": 1000, "watchdog": False}`: where
    it stands at the start in counts, and whether it watches for its controller. Its time is that of the source that exchanges with it,
    so that a program under the virtual clock has the same values each time.
    """
    if not drives:
        refuse(CallError, "a bus has no drive", 'name them: gpac.drivers.fake.canopen("x", "y")')
    named = [{"name": drive, "node": at} if isinstance(drive, str) else {"node": at, **drive} for at, drive in enumerate(drives, 1)]
    return CanOpenBus(named)
