# SPDX-License-Identifier: Apache-2.0
"""Event stream of a control interface: the client side of a WebSocket (RFC 6455) whose frames are JSON texts.

Messages from the client are short and never fragmented; a server's frames are not masked. Large frames and fragments are reassembled.
"""

from __future__ import annotations

import base64
import hashlib
import http.client
import json
import os
import socket
import struct
from collections.abc import Mapping
from typing import Any

from ..errors import ConnectionLost
from .transport import Transport

_ACCEPT = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
_CONTINUED, _TEXT, _CLOSE, _PING, _PONG = 0x0, 0x1, 0x8, 0x9, 0xA


class Stream:
    """An open stream. One thread reads it; `shut`, called from another thread, interrupts the read with `ConnectionLost`."""

    def __init__(self, transport: Transport, more: Mapping[str, str]) -> None:
        key = base64.b64encode(os.urandom(16))
        asked = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": key.decode()}
        self._connection = transport.hold("/v1/stream", {**more, **asked})
        self._transport = transport
        self._answer = http.client.HTTPResponse(self._socket())
        try:
            self._answer.begin()
            accepted = base64.b64encode(hashlib.sha1(key + _ACCEPT).digest()).decode()
            if self._answer.status != 101 or self._answer.getheader("Sec-WebSocket-Accept") != accepted:
                raise ConnectionLost(f"the system at {transport.address} does not provide a stream: status {self._answer.status}")
        except BaseException:
            self.close()
            raise

    def send(self, message: Any) -> None:
        """Sends one text message."""
        self._send(_TEXT, json.dumps(message).encode())

    def receive(self) -> Any:
        """Returns the next message, answering pings in the meantime. Raises `ConnectionLost` at the end of the stream."""
        whole = b""
        while True:
            first, length = self._exactly(2)
            if length & 0x7F == 126:
                (size,) = struct.unpack(">H", self._exactly(2))
            elif length & 0x7F == 127:
                (size,) = struct.unpack(">Q", self._exactly(8))
            else:
                size = length & 0x7F
            kind, part = first & 0x0F, self._exactly(size)
            if kind == _CLOSE:
                # A code of two bytes, and possibly a reason: a revoked token, a changed role.
                why = part[2:].decode(errors="replace")
                raise ConnectionLost(f"the stream has ended: {why}" if why else "the stream has ended")
            if kind == _PING:
                self._send(_PONG, part)
            elif kind in (_TEXT, _CONTINUED):
                whole += part
                if first & 0x80:
                    return json.loads(whole)

    def shut(self) -> None:
        """Ends the stream, so that the reading thread stops."""
        try:
            self._socket().shutdown(socket.SHUT_RDWR)
        except OSError:
            # The other side has closed first.
            return

    def close(self) -> None:
        """Closes the connection."""
        self._answer.close()
        self._transport.release(self._connection)

    def _socket(self) -> socket.socket:
        if self._connection.sock is None:
            raise ConnectionLost("the stream has ended")
        return self._connection.sock

    def _exactly(self, size: int) -> bytes:
        assert self._answer.fp is not None
        got = self._answer.fp.read(size) if size else b""
        if len(got) < size:
            raise ConnectionLost("the stream has ended")
        return got

    def _send(self, kind: int, text: bytes) -> None:
        """Sends one masked frame, as required of clients."""
        mask = os.urandom(4)
        size = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + struct.pack(">H", len(text))
        masked = bytes(byte ^ mask[k % 4] for k, byte in enumerate(text))
        self._socket().sendall(bytes([0x80 | kind]) + size + mask + masked)
