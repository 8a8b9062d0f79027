# SPDX-License-Identifier: Apache-2.0
"""Interface between the package and a real-time system.

A system embedded in this process (`EmbeddedSystem`) and one reached through its control interface (`remote.Remote`) have the same
calls, which are declared in Rust (`calls.py` is generated from them); the layers above cannot distinguish them. High-rate transfers
are defined here. Refusals are raised as `_native.Refused`.
"""

from __future__ import annotations

from .. import _native
from .calls import Calls


class RealTimeSystem(Calls):
    """Calls that this package makes to a real-time system."""

    __slots__ = ()

    def read(self, names: list[str], /) -> tuple[int, list[tuple[bytes, int, int]]]:
        """Returns one consistent snapshot: its time, and the bytes, number and time of each SVV."""
        raise NotImplementedError

    def turn(self, stores: list[tuple[str, list[float]]], duration_ns: int, names: list[str], /) -> bytes:
        """Stores numbers, runs the firings within the duration under the virtual clock, and returns the concatenated bytes of all SVVs.

        A system in this process does this in a single call.
        """
        for name, numbers in stores:
            self.write(name, numbers[0] if len(numbers) == 1 else numbers)
        self.advance(duration_ns)
        return b"".join(r[0] for r in self.read(names)[1])

    def history(self, name: str, count: int, /) -> list[tuple[int, int, bytes]]:
        """Returns the most recent values, oldest first, each as number, time and bytes."""
        raise NotImplementedError

    def performing(self, arguments_json: str, made: list[int], slice_ns: int, /) -> str | None:
        """Runs the call `perform` for up to `slice_ns`, and returns the end report, or None if the verb is still running, with its
        instance in `made`."""
        raise NotImplementedError

    def ended_fd(self) -> int:
        """Returns a descriptor that becomes readable when an instance has ended (monotonic clock); os.read(fd, 8) drains it."""
        raise NotImplementedError

    def close(self) -> None:
        """Halts the actions, disables the devices, and stops the kernels. Idempotent."""
        raise NotImplementedError


class EmbeddedSystem(_native.System, RealTimeSystem):
    """A system in this process."""

    __slots__ = ()
