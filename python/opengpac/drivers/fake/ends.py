# SPDX-License-Identifier: Apache-2.0
"""Endpoints for emulated devices: a TCP port on this host, or a pseudo-terminal.

No thread here waits for a client: data that no client reads is lost, as on a real line, and each wait ends when the endpoint is
closed.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
import threading
import tty
from collections.abc import Callable

Receive = Callable[[bytearray, Callable[[bytes], None]], None]
"""Function that consumes complete messages from the front of the received bytes, and sends answers through the function passed to it."""

UNREAD_S = 10
"""Time for which a client may leave data unread before the rest is dropped, s."""


class Closing:
    """A flag that wakes a thread waiting for a descriptor. Unlike a pipe, it is not affected by a copy in a forked process."""

    def __init__(self) -> None:
        self._flag = os.eventfd(0)

    def tell(self) -> None:
        """Ends the current wait and all later ones."""
        os.eventfd_write(self._flag, 1)

    def readable(self, descriptor: int) -> bool:
        """Waits until a descriptor is readable; returns False if the flag was set first."""
        polled = select.poll()
        for each in (descriptor, self._flag):
            polled.register(each, select.POLLIN)
        return self._flag not in dict(polled.poll())

    def close(self) -> None:
        """Releases the flag. No thread may be waiting for it."""
        os.close(self._flag)


class Terminal:
    """A pseudo-terminal in raw mode; `path` is the path that a program opens."""

    def __init__(self) -> None:
        self.device, self._line = os.openpty()
        tty.setraw(self._line)
        os.set_blocking(self.device, False)
        self.path = os.ttyname(self._line)

    def read(self) -> bytes:
        """Returns the data that a program has written."""
        with contextlib.suppress(BlockingIOError):
            return os.read(self.device, 4096)
        return b""

    def write(self, data: bytes) -> None:
        """Sends data to the program; data that does not fit because the program does not read is lost."""
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self.device, data) :]

    def close(self) -> None:
        """Closes the pseudo-terminal; a program that has it open sees a disconnect."""
        os.close(self._line)
        os.close(self.device)


class TcpEnd:
    """A TCP port on the loopback interface. While stopped it remains reserved, but connections are refused."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._held = self._bound(0)
        self.port: int = self._held.getsockname()[1]
        self._listener: socket.socket | None = None
        self._open: set[socket.socket] = set()
        self._lock = threading.Lock()

    @staticmethod
    def _bound(port: int) -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(("127.0.0.1", port))
        return made

    def start(self) -> None:
        """Starts sending and receiving."""
        listener = self._bound(self.port)
        listener.listen()
        self._listener = listener
        threading.Thread(target=self._accept, args=(listener,), daemon=True).start()

    def stop(self) -> None:
        """Closes every connection."""
        with self._lock:
            listener, self._listener = self._listener, None
            ended = list(self._open)
        for each in [*ended, *([listener] if listener else [])]:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
        if listener:
            listener.close()

    def close(self) -> None:
        """Releases the port."""
        self.stop()
        self._held.close()

    def send(self, data: bytes) -> None:
        """Sends data to all clients, including those just accepted."""
        if (listener := self._listener) is not None:
            self._take_in(listener)
        with self._lock:
            open_now = list(self._open)
        for each in open_now:
            with contextlib.suppress(OSError):
                each.sendall(data)

    @property
    def connected(self) -> int:
        """Number of connected clients."""
        with self._lock:
            return len(self._open)

    def _accept(self, listener: socket.socket) -> None:
        with contextlib.suppress(OSError, ValueError):
            while self._take_in(listener):
                select.select([listener], [], [])

    def _take_in(self, listener: socket.socket) -> bool:
        """Accepts all pending connections; returns False if the endpoint is stopped."""
        with self._lock:
            while self._listener is listener and select.select([listener], [], [], 0)[0]:
                connection, _ = listener.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("@ll", UNREAD_S, 0))
                self._open.add(connection)
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()
            return self._listener is listener

    def _serve(self, connection: socket.socket) -> None:
        came = bytearray()
        with contextlib.suppress(OSError):
            while more := connection.recv(4096):
                came += more
                self._receive(came, connection.sendall)
        with self._lock:
            self._open.discard(connection)
        connection.close()


class SerialEnd:
    """A pseudo-terminal. While stopped it is silent, like an unplugged device."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._terminal, self._closing = Terminal(), Closing()
        self.path = self._terminal.path
        self._is_on = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def start(self) -> None:
        """Starts listening."""
        self._is_on.set()

    def stop(self) -> None:
        """Stops sending and receiving."""
        self._is_on.clear()

    def close(self) -> None:
        """Closes the line."""
        self._closing.tell()
        self._thread.join()
        self._terminal.close()
        self._closing.close()

    def send(self, data: bytes) -> None:
        """Sends data on the line."""
        if self._is_on.is_set():
            self._terminal.write(data)

    @property
    def connected(self) -> int:
        """Number of connected clients; always 1, because a serial line does not reveal its readers."""
        return 1

    def _serve(self) -> None:
        came = bytearray()
        while self._closing.readable(self._terminal.device):
            came += self._terminal.read()
            if self._is_on.is_set():
                self._receive(came, self.send)
            else:
                came.clear()
