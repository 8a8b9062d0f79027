# SPDX-License-Identifier: Apache-2.0
"""A browser's use of the address of a studio, as plain requests: fetches, calls, a WebSocket."""

from __future__ import annotations

import http.client
import json
import os
import socket
import struct
from base64 import b64encode
from typing import Any
from urllib.parse import urlsplit

PATIENCE_S = 180.0


class Browser:
    """Page at an address: `http://127.0.0.1:PORT/#token=TOKEN`."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        assert parts.hostname == "127.0.0.1" and parts.port
        self.host, self.port = parts.hostname, parts.port
        self.token = parts.fragment.removeprefix("token=")
        self.origin = f"http://{self.host}:{self.port}"
        self.session = ""

    def fetch(self, method: str, path: str, body: Any = None, token: str | None = None) -> tuple[int, str]:
        """Makes a request as the page does; without a token if that is empty. Returns status and text."""
        connection = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE_S)
        headers = {"Origin": self.origin}
        if bearer := self.token if token is None else token:
            headers["Authorization"] = f"Bearer {bearer}"
        if self.session:
            headers["OpenGPAC-Session"] = self.session
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer.status, text

    def call(self, name: str, /, **arguments: Any) -> Any:
        """Returns the result of a call, which must succeed."""
        status, text = self.fetch("POST", f"/v1/call/{name}", arguments)
        assert status == 200, text
        return json.loads(text)["result"]

    def refused(self, name: str, /, **arguments: Any) -> str:
        """Returns the error class of a refused call."""
        status, text = self.fetch("POST", f"/v1/call/{name}", arguments)
        assert status >= 400, text
        return json.loads(text)["errors"][0]["class"]

    def command(self, name: str = "studio-test") -> None:
        """Opens a session and takes command."""
        _, text = self.fetch("POST", "/v1/sessions", {"name": name})
        self.session = json.loads(text)["result"]["session"]
        status, text = self.fetch("POST", "/v1/command", {})
        assert status == 200, text

    def stream(self) -> Stream:
        """Opens the stream, as a page does."""
        return Stream(self)


class Stream:
    """WebSocket (RFC 6455) whose token is a subprotocol."""

    def __init__(self, browser: Browser) -> None:
        self.wire = socket.create_connection((browser.host, browser.port), timeout=PATIENCE_S)
        lines = [
            "GET /v1/stream HTTP/1.1",
            f"Host: {browser.host}:{browser.port}",
            f"Origin: {browser.origin}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Key: {b64encode(os.urandom(16)).decode()}",
            f"Sec-WebSocket-Protocol: opengpac.v1, bearer.{browser.token}",
        ]
        self.wire.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self._exactly(1)
        assert head.startswith(b"HTTP/1.1 101") and b"opengpac.v1" in head, head

    def say(self, **frame: Any) -> None:
        """Sends a text frame."""
        text = json.dumps(frame).encode()
        size = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + struct.pack(">H", len(text))
        self.wire.sendall(b"\x81" + size + bytes(4) + text)

    def next(self) -> Any:
        """Returns the next frame: the value of JSON, the bytes of a scope."""
        while True:
            first, length = self._exactly(2)
            size = length
            if length >= 126:
                form, wide = (">H", 2) if length == 126 else (">Q", 8)
                (size,) = struct.unpack(form, self._exactly(wide))
            content = self._exactly(size)
            if first == 0x81:
                return json.loads(content)
            if first == 0x82:
                return content

    def close(self) -> None:
        """Ends the stream."""
        self.wire.close()

    def _exactly(self, size: int) -> bytes:
        parts = b""
        while len(parts) < size:
            part = self.wire.recv(size - len(parts))
            assert part, "the stream has ended"
            parts += part
        return parts
