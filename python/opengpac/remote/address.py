# SPDX-License-Identifier: Apache-2.0
"""Addresses of remote real-time systems: `unix:///path.sock`, `http://127.0.0.1:PORT`, `https://HOST:PORT`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from ..errors import CallError, did_you_mean, refuse

SCHEMES = ("unix", "http", "https")
FORMS = "write unix:///path.sock, http://127.0.0.1:PORT or https://HOST:PORT"


@dataclass(frozen=True)
class Address:
    """Address of a control interface: a Unix socket, or a host and port, with or without TLS."""

    url: str
    path: str = ""
    """Path of the Unix socket; empty for a host and port."""
    host: str = "localhost"
    port: int = 0
    secure: bool = False

    def __str__(self) -> str:
        return self.url


def address(url: object) -> Address:
    """Parses the URL of a system. Raises `CallError` for an unsupported scheme, a host without a port, or a malformed URL."""
    if not isinstance(url, str) or "://" not in url:
        refuse(CallError, f"{url!r} is not the URL of a system", FORMS)
    scheme = url.split("://", 1)[0]
    if scheme not in SCHEMES:
        refuse(CallError, f"{url!r} is not the URL of a system: its scheme cannot be '{scheme}'", did_you_mean(scheme, SCHEMES) or FORMS)
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        refuse(CallError, f"{url!r} is not the URL of a system: {str(error).lower()}", FORMS)
    if parts.query or parts.fragment or "@" in parts.netloc:
        refuse(CallError, f"the URL of a system must be a plain address, not {url!r}", "pass a token as token=, never in the URL")
    if scheme == "unix":
        return _socket(url, parts.netloc, parts.path)
    if not parts.hostname or port is None or parts.path not in ("", "/"):
        refuse(CallError, f"{url!r} is not the URL of a system", f"write a host and a port only: {scheme}://HOST:PORT")
    return Address(url, host=parts.hostname, port=port, secure=scheme == "https")


def _socket(url: str, host: str, path: str) -> Address:
    if host or not path.strip("/"):
        refuse(
            CallError,
            f"{url!r} is not the URL of a system",
            "write an absolute path for a Unix socket, with three slashes: unix:///run/cell.sock",
        )
    return Address(url, path=str(Path(path)))
