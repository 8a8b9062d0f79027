# SPDX-License-Identifier: Apache-2.0
"""Requests to a control interface over HTTP, through a Unix socket or a TCP port, with or without TLS.

Connections are kept and reused, each by one thread at a time, so that a call costs one round trip. A request is sent once and never
repeated: without an answer, the client cannot know whether the call was executed, and a motion must not start twice.
"""

from __future__ import annotations

import contextlib
import http.client
import select
import socket
import ssl
import threading
from collections.abc import Callable, Mapping
from typing import NoReturn

from ..errors import CallError, ConnectionLost, refuse
from . import answers
from .address import Address
from .answers import Answer, Incoming

CONNECT_S = 5.0
"""Time limit for the server to accept a connection, s."""

LATE_S = 2.0
"""Time limit for the answer to an interrupted request, s."""

_NOTHING: Mapping[str, str] = {}


class _OverSocket(http.client.HTTPConnection):
    """An HTTP connection over a Unix socket."""

    def __init__(self, path: str) -> None:
        super().__init__("localhost", timeout=CONNECT_S)
        self._path = path

    def connect(self) -> None:
        """Opens the socket."""
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(CONNECT_S)
        self.sock.connect(self._path)


class Transport:
    """Sends requests to one address; thread-safe."""

    def __init__(self, to: Address, token: str | None, tls: ssl.SSLContext | None) -> None:
        self.address = to
        self._tls = tls
        self._host = f"[{to.host}]:{to.port}" if ":" in to.host else f"{to.host}:{to.port}" if to.port else to.host
        if token is not None and not (token.isascii() and token.isprintable()):
            refuse(CallError, "the token contains invalid characters", "pass it exactly as opengpac token new printed it")
        self.token = token
        """Token for authentication; None if there is none."""
        self._headers = {"Authorization": f"Bearer {token}"} if token is not None else {}
        self._lock = threading.Lock()
        self._idle: list[http.client.HTTPConnection] = []
        self._busy: set[http.client.HTTPConnection] = set()
        self._held: set[http.client.HTTPConnection] = set()
        self._cut = ""
        self.reached = False
        """True if the server at the address has answered before."""
        self.remedy = ""
        """Remedy for a lost connection, included in every error."""

    def request(
        self,
        method: str,
        path: str,
        body: bytes = b"",
        *,
        more: Mapping[str, str] = _NOTHING,
        timeout_s: float | None = None,
        late: Callable[[Answer], None] | None = None,
    ) -> Answer:
        """Sends a request, and returns its answer. `timeout_s` is the time limit for the answer; by default there is none while the
        connection lasts.

        Raises `ConnectionLost` if no answer arrives. An interrupt, Ctrl-C, ends the wait immediately. With `late`, the interrupt
        first waits for the answer, which arrives soon, and passes it to `late`, because the answer identifies what the request has
        started.
        """
        headers = {**self._headers, "Content-Type": "application/json", "Content-Length": str(len(body)), **more}
        text = self._text(method, path, headers) + body
        connection = self._take()
        incoming = Incoming(keeps=late is not None)
        try:
            told, keep = self._exchange(connection, text, timeout_s, incoming)
        except (OSError, http.client.HTTPException) as error:
            self._drop(connection)
            self._lost(error)
        except BaseException:
            if late is not None and connection.sock is not None:
                with contextlib.suppress(OSError, http.client.HTTPException, ValueError, KeyError):
                    connection.sock.settimeout(LATE_S)
                    late(answers.read(connection.sock, incoming.again())[0])
            # Otherwise the answer to this request would be taken for that to the next.
            self._drop(connection)
            raise
        self._give_back(connection, keep)
        return told

    def _exchange(
        self, connection: http.client.HTTPConnection, text: bytes, timeout_s: float | None, incoming: Incoming
    ) -> tuple[Answer, bool]:
        """Sends a complete request and reads its answer; returns it and whether the connection can be reused."""
        wire = _opened(connection)
        wire.settimeout(timeout_s)
        # A request answered before it was read completely still has a valid answer.
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            wire.sendall(text)
        return answers.read(wire, incoming)

    def hold(self, path: str, more: Mapping[str, str]) -> http.client.HTTPConnection:
        """Sends a request on a separate connection; the caller waits for the answer, and passes the connection to `release`."""
        connection = self._new()
        try:
            wire = _opened(connection)
            wire.settimeout(None)
            wire.sendall(self._text("GET", path, {**self._headers, **more}))
        except OSError as error:
            connection.close()
            self._lost(error)
        with self._lock:
            self._held.add(connection)
        return connection

    def release(self, connection: http.client.HTTPConnection) -> None:
        """Closes a held connection."""
        with self._lock:
            self._held.discard(connection)
        connection.close()

    def cut(self, why: str) -> None:
        """Ends every pending request, and refuses further ones, because the server no longer answers."""
        with self._lock:
            self._cut = self._cut or why
            waiting = [*self._busy, *self._held]
        for connection in waiting:
            if connection.sock is not None:
                # Closing alone would leave another thread waiting on that socket.
                try:
                    connection.sock.shutdown(socket.SHUT_RDWR)
                except OSError:
                    continue
        self.close()

    @property
    def is_cut(self) -> bool:
        """True if the server has stopped answering and requests are refused."""
        return bool(self._cut)

    def close(self) -> None:
        """Closes the idle connections."""
        with self._lock:
            idle, self._idle = self._idle, []
        for connection in idle:
            connection.close()

    def _text(self, method: str, path: str, headers: Mapping[str, str]) -> bytes:
        """Returns the text of a request's header."""
        lines = [f"{method} {path} HTTP/1.1", f"Host: {self._host}", *(f"{name}: {value}" for name, value in headers.items())]
        return "\r\n".join([*lines, "", ""]).encode("latin-1")

    def _take(self) -> http.client.HTTPConnection:
        while True:
            with self._lock:
                if self._cut:
                    self._lost(None)
                connection = self._idle.pop() if self._idle else self._new()
                if not _hung_up(connection):
                    self._busy.add(connection)
                    return connection
            connection.close()

    def _new(self) -> http.client.HTTPConnection:
        if self.address.path:
            return _OverSocket(self.address.path)
        if self._tls is not None:
            return http.client.HTTPSConnection(self.address.host, self.address.port, timeout=CONNECT_S, context=self._tls)
        return http.client.HTTPConnection(self.address.host, self.address.port, timeout=CONNECT_S)

    def _give_back(self, connection: http.client.HTTPConnection, keep: bool) -> None:
        with self._lock:
            self._busy.discard(connection)
            kept = keep and not self._cut
            if kept:
                self._idle.append(connection)
        if not kept:
            connection.close()

    def _drop(self, connection: http.client.HTTPConnection) -> None:
        with self._lock:
            self._busy.discard(connection)
        connection.close()

    def _lost(self, error: Exception | None) -> NoReturn:
        why = self._cut or _reason(error)
        what = f"the connection to the system at {self.address} was lost" if self.reached else f"no system answers at {self.address}"
        refuse(ConnectionLost, f"{what}: {why}", self.remedy)


def _opened(connection: http.client.HTTPConnection) -> socket.socket:
    """Returns the socket of a connection; opens it if necessary."""
    if connection.sock is None:
        connection.connect()
    assert connection.sock is not None
    return connection.sock


def spoken(connection: http.client.HTTPConnection) -> bool:
    """Returns whether the server has answered a held request or closed its connection. TLS protocol messages do not count."""
    assert connection.sock is not None
    connection.sock.setblocking(False)
    try:
        connection.sock.recv(1)
    except (BlockingIOError, ssl.SSLWantReadError):
        return False
    except OSError:
        return True
    return True


def _hung_up(connection: http.client.HTTPConnection) -> bool:
    """Returns whether the server has closed an idle connection: if the socket is readable, that can only be its end."""
    return connection.sock is not None and bool(readable(0.0, connection.sock))


def readable(within_s: float, *descriptors: socket.socket | int) -> list[int]:
    """Returns the descriptors that become readable within `within_s` seconds. Their numbers may exceed the limit of `select.select`."""
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, select.POLLIN)
    return [descriptor for descriptor, _ in poll.poll(within_s * 1e3)]


def _reason(error: Exception | None) -> str:
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is not accepted: {error.verify_message}"
    if isinstance(error, TimeoutError):
        return "it does not answer"
    if isinstance(error, http.client.HTTPException) and not isinstance(error, OSError):
        return f"the answer does not come from a control interface: {type(error).__name__}"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return str(error).lower()
