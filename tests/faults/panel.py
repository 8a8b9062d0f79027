# SPDX-License-Identifier: Apache-2.0
"""A minimal panel: requests over one TCP connection, without the package, so that the package's time is not measured."""

from __future__ import annotations

import base64
import json
import os
import socket
import struct
from typing import Any

PATIENCE_S = 60.0
"""Safety net, not a measure."""


class Panel:
    """Connection of a caller to a control interface."""

    def __init__(self, port: int, token: str, session: str = "") -> None:
        self.wire = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
        self.wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.head = f"host: localhost\r\nauthorization: Bearer {token}\r\n" + (f"opengpac-session: {session}\r\n" if session else "")
        self.file = self.wire.makefile("rb")

    def ask(self, method: str, path: str, body: bytes = b"") -> tuple[int, Any]:
        """Makes a request; returns its status and its answer."""
        self.wire.sendall(f"{method} {path} HTTP/1.1\r\n{self.head}content-length: {len(body)}\r\n\r\n".encode() + body)
        line = self.file.readline()
        if not line:
            raise ConnectionResetError("the connection was closed")
        size = 0
        while header := self.file.readline().strip():
            if header.lower().startswith(b"content-length:"):
                size = int(header.partition(b":")[2])
        return int(line.split()[1]), json.loads(self.file.read(size) or b"null")

    def call(self, name: str, /, **arguments: Any) -> tuple[int, Any]:
        """Makes a call; returns its status and its answer."""
        return self.ask("POST", f"/v1/call/{name}", json.dumps(arguments).encode())

    def must(self, name: str, /, **arguments: Any) -> Any:
        """Makes a call that must not be refused; returns its result."""
        status, answer = self.call(name, **arguments)
        assert status == 200, (name, answer)
        return answer.get("result")

    def to_its_end(self, name: str, /, **arguments: Any) -> Any:
        """Makes a long call in as many slices as necessary; returns its result."""
        while True:
            status, answer = self.call(name, **arguments)
            assert status == 200, (name, answer)
            if "go_on" not in answer:
                return answer.get("result")
            name, arguments = answer["go_on"]["call"], answer["go_on"]["arguments"]

    def commander(self, name: str) -> str:
        """Opens a commanding session, which this connection uses from then on."""
        status, opened = self.ask("POST", "/v1/sessions", json.dumps({"name": name, "lost_after_ms": 60_000}).encode())
        assert status == 200, opened
        session = opened["result"]["session"]
        self.head += f"opengpac-session: {session}\r\n"
        assert self.ask("POST", "/v1/command", b"{}")[0] == 200
        return session

    def stream(self) -> None:
        """Turns the connection into a stream."""
        key = base64.b64encode(os.urandom(16)).decode()
        upgrade = f"connection: Upgrade\r\nupgrade: websocket\r\nsec-websocket-version: 13\r\nsec-websocket-key: {key}\r\n"
        self.wire.sendall(f"GET /v1/stream HTTP/1.1\r\n{self.head}{upgrade}\r\n".encode())
        assert b"101" in self.file.readline()
        while self.file.readline().strip():
            pass

    def say(self, frame: dict[str, Any]) -> None:
        """Sends a frame on the stream."""
        text = json.dumps(frame).encode()
        assert len(text) < 126
        mask = os.urandom(4)
        self.wire.sendall(bytes([0x81, 0x80 | len(text)]) + mask + bytes(byte ^ mask[k % 4] for k, byte in enumerate(text)))

    def hear(self) -> tuple[int, bytes]:
        """Returns kind and content of the next frame of the stream; kind 8 closes the stream, with a code of two bytes and a reason."""
        first, length = self._exactly(2)
        if length == 126:
            (length,) = struct.unpack(">H", self._exactly(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self._exactly(8))
        return first & 0x0F, self._exactly(length)

    def _exactly(self, size: int) -> bytes:
        got = self.file.read(size) if size else b""
        if len(got) < size:
            raise ConnectionResetError("the stream has ended")
        return got

    def close(self) -> None:
        """Closes the connection."""
        self.file.close()
        self.wire.close()
