# SPDX-License-Identifier: Apache-2.0
"""Reads HTTP/1.1 responses (RFC 9112) from a socket. Replaces the standard library because reading adds to the latency of a remote
start: the standard library parses headers as e-mail headers, which takes longer than all other work of a request."""

from __future__ import annotations

import http.client
import socket
from typing import NamedTuple, Self

_ROOM = 1 << 16
"""Size of a read in bytes, which is also the maximum size of a response header."""


class Answer(NamedTuple):
    """Response of the server."""

    status: int
    body: bytes
    again_s: float = 0.01
    """Delay before a retry if the server was too busy and refused the request."""


def read(wire: socket.socket, incoming: Incoming | None = None) -> tuple[Answer, bool]:
    """Returns the next response, and whether the connection can be reused. `incoming` is new, or holds the data received before an
    interrupt.

    Raises `OSError` if no response arrives, and `http.client.HTTPException` if it is malformed.
    """
    incoming = incoming or Incoming()
    incoming.wire = wire
    version, status, headers = _head(incoming.until(b"\r\n\r\n"))
    while status < 200:
        # Skip interim answers, such as 100 (Continue).
        version, status, headers = _head(incoming.until(b"\r\n\r\n"))
    body, to_the_end = _body(incoming, status, headers)
    keep = version == b"HTTP/1.1" and headers.get(b"connection", b"").lower() != b"close" and not to_the_end and incoming.is_empty
    return Answer(status, body, _seconds(headers.get(b"retry-after"))), keep


class Incoming:
    """Bytes received from a socket, read incrementally. With `keeps` it retains all of them, so that `again` can reread them."""

    def __init__(self, keeps: bool = False) -> None:
        self.wire: socket.socket
        self._all: list[bytes] | None = [] if keeps else None
        self._came = b""
        self._began = False

    def again(self) -> Self:
        """Returns the same data from the beginning, for use after an interrupted read."""
        self._came = b"".join(self._all or ())
        return self

    @property
    def is_empty(self) -> bool:
        """True if all received data have been consumed."""
        return not self._came

    def until(self, mark: bytes) -> bytes:
        """Returns all data before a delimiter, and consumes the delimiter too."""
        while (end := self._came.find(mark)) < 0:
            if len(self._came) > _ROOM:
                raise http.client.LineTooLong("head")
            if not self._more():
                if self._began:
                    raise http.client.BadStatusLine(repr(self._came[:80]))
                raise http.client.RemoteDisconnected("the other side has closed the connection")
        taken, self._came = self._came[:end], self._came[end + len(mark) :]
        return taken

    def exactly(self, size: int) -> bytes:
        """Reads exactly `size` bytes."""
        parts, missing = [self._came[:size]], size - len(self._came)
        self._came = self._came[size:]
        while missing > 0:
            part = self.wire.recv(min(missing, _ROOM))
            self._keep(part)
            if not part:
                raise http.client.IncompleteRead(b"".join(parts), missing)
            parts.append(part)
            missing -= len(part)
        return b"".join(parts)

    def _keep(self, part: bytes) -> None:
        if self._all is not None:
            self._all.append(part)

    def rest(self) -> bytes:
        """Reads all data until the end."""
        while self._more():
            pass
        taken, self._came = self._came, b""
        return taken

    def _more(self) -> bool:
        part = self.wire.recv(_ROOM)
        self._keep(part)
        self._came += part
        self._began = self._began or bool(part)
        return bool(part)


def _head(text: bytes) -> tuple[bytes, int, dict[bytes, bytes]]:
    """Returns the version, the status, and the headers by their lower-case names."""
    first, *lines = text.split(b"\r\n")
    version, _, told = first.partition(b" ")
    if version not in (b"HTTP/1.1", b"HTTP/1.0") or not (told[:3].isdigit() and told[3:4] in (b"", b" ")):
        raise http.client.BadStatusLine(repr(first[:80]))
    named = (line.partition(b":") for line in lines)
    return version, int(told[:3]), {name.lower(): value.strip() for name, _, value in named}


def _body(incoming: Incoming, status: int, headers: dict[bytes, bytes]) -> tuple[bytes, bool]:
    """Returns the body, and whether the end of the connection terminated it."""
    if status in (204, 304):
        return b"", False
    if headers.get(b"transfer-encoding", b"").lower() == b"chunked":
        return b"".join(_chunks(incoming)), False
    length = headers.get(b"content-length")
    if length is None:
        return incoming.rest(), True
    if not length.isdigit():
        raise http.client.BadStatusLine(f"an invalid length, {length[:80]!r}")
    return incoming.exactly(int(length)), False


def _chunks(incoming: Incoming) -> list[bytes]:
    """Returns the chunks of a chunked body."""
    parts: list[bytes] = []
    while True:
        size = incoming.until(b"\r\n").partition(b";")[0].strip()
        if not size or size.strip(b"0123456789abcdefABCDEF"):
            raise http.client.BadStatusLine(f"a chunk of invalid length, {size[:80]!r}")
        part = incoming.exactly(int(size, 16))
        if not part:
            break
        parts.append(part)
        incoming.until(b"\r\n")
    while incoming.until(b"\r\n"):
        pass
    return parts


def _seconds(text: bytes | None) -> float:
    try:
        return min(max(float(text or 0.0), 0.01), 10.0)
    except ValueError:
        return 1.0
