# SPDX-License-Identifier: Apache-2.0
"""The stream of a control interface: a WebSocket (RFC 6455) whose frames are JSON texts. The client's half of it, no more.

What this end has to send is short and never in parts; a server's frames are not masked. Large frames and fragments are taken whole.
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
    """An open stream. One thread reads it; `shut` by another ends that with `ConnectionLost`."""

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
                raise ConnectionLost(f"the system at {transport.address} gives no stream: status {self._answer.status}")
        except BaseException:
            self.close()
            raise

    def send(self, message: Any) -> None:
        """Sends one text."""
        self._send(_TEXT, json.dumps(message).encode())

    def receive(self) -> Any:
        """The next message; answers pings meanwhile. `ConnectionLost` at the end of the stream."""
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
                # A code of two bytes, and why where there is a reason: a token that was revoked, a role that has changed.
                why = part[2:].decode(errors="replace")
                raise ConnectionLost(f"the stream has ended: {why}" if why else "the stream has ended")
            if kind == _PING:
                self._send(_PONG, part)
            elif kind in (_TEXT, _CONTINUED):
                whole += part
                if first & 0x80:
                    return json.loads(whole)

    def shut(self) -> None:
        """Ends it for the thread that reads it."""
        try:
            self._socket().shutdown(socket.SHUT_RDWR)
        except OSError:
            # The other side was first.
            return

    def close(self) -> None:
        """Frees the connection."""
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
        """Sends one frame, masked as a client's have to be."""
        mask = os.urandom(4)
        size = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + struct.pack(">H", len(text))
        masked = bytes(byte ^ mask[k % 4] for k, byte in enumerate(text))
        self._socket().sendall(bytes([0x80 | kind]) + size + mask + masked)
