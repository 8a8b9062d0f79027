# SPDX-License-Identifier: Apache-2.0
"""A descriptor for event loops that becomes readable when an instance of a remote system has ended."""

from __future__ import annotations

import os
import threading

from ..errors import ConnectionLost
from .session import Session
from .stream import Stream


class Ends:
    """Monitors the event stream for ends of instances, in a separate thread that is started by the first check.

    The end of the stream makes the descriptor readable too: a waiting call then requests the state, and raises `ConnectionLost`.
    """

    def __init__(self, session: Session) -> None:
        self.fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._stream = Stream(session.transport, session.headers)
        self._stream.send({"subscribe": "ends", "id": "ends"})
        self._thread = threading.Thread(target=self._follow, name=f"opengpac ends {session.url}", daemon=True)
        self._thread.start()

    def _follow(self) -> None:
        try:
            while True:
                told = self._stream.receive()
                if told.get("ends") or told.get("dropped"):
                    os.eventfd_write(self.fd, 1)
        except (OSError, ValueError, ConnectionLost):
            os.eventfd_write(self.fd, 1)

    def close(self) -> None:
        """Stops the thread and closes the descriptor."""
        self._stream.shut()
        self._thread.join()
        self._stream.close()
        os.close(self.fd)
