# SPDX-License-Identifier: Apache-2.0
"""Opens sessions with remote systems."""

from __future__ import annotations

import os
import re
import ssl
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import CallError, OutOfRange, refuse
from ..values.quantities import Quantity, duration_ns
from .address import Address, address
from .session import Session
from .transport import Transport

File = str | os.PathLike[str]

_opened: dict[tuple[str, str], Session] = {}
"""Sessions of this process, by URL and name. The process may take over its own lost session, even if the system still considers it
alive."""


def instead(url: str, name: str, virtual: bool, interconnect: str | Mapping[str, Any]) -> Session:
    """Returns the session of a program that creates its own system, if `OPENGPAC_SYSTEM` redirects it to a daemon."""
    if interconnect != "memory":
        refuse(
            CallError,
            f"system '{name}' cannot have interconnect={interconnect!r}: OPENGPAC_SYSTEM names the system at {url}",
            "omit interconnect=, or unset the variable",
        )
    session = open_session(url, re.sub(r"[^A-Za-z0-9._-]", "-", name))
    there = session.version["clock"]
    if (there == "virtual") != virtual:
        session.close()
        wanted = "virtual" if virtual else "monotonic"
        refuse(
            CallError,
            f"system '{name}' needs the {wanted} clock, but the one at {url}, which OPENGPAC_SYSTEM names, has the {there} clock",
            f"start that system with --clock {wanted}",
        )
    session.whole = True
    return session


def open_session(
    url: object,
    name: str | None,
    *,
    token: str | None = None,
    ca: File | None = None,
    certificate: File | None = None,
    command: bool = True,
    lost_after: Quantity = "5 s",
    person: str | None = None,
) -> Session:
    """Opens a session with the system at a URL, with command if requested, as described in `connect`."""
    to = address(url)
    named = re.sub(r"[^A-Za-z0-9._-]", "-", f"{Path(sys.argv[0]).stem or 'python'}-{os.getpid()}") if name is None else name
    if not isinstance(named, str):
        refuse(CallError, f"the name of a session must be a string, not {name!r}", "write 'operator', for example")
    lost_after_ns = duration_ns(lost_after, "lost_after")
    if lost_after_ns <= 0:
        refuse(OutOfRange, f"lost_after= must be from 1 s to 60 s, not {lost_after!r}", "pass '5 s', for example")
    transport = Transport(to, token if token is not None else os.environ.get("OPENGPAC_TOKEN"), _tls(to, ca, certificate))
    before = _opened.get((to.url, named))
    take_up = before is not None and before.lost
    try:
        session = Session(transport, named, lost_after_ns, take_up, person)
    except BaseException:
        transport.close()
        raise
    _opened[to.url, named] = session
    if command:
        try:
            session.take_command()
        except BaseException:
            session.close()
            raise
    return session


def _tls(to: Address, ca: File | None, certificate: File | None) -> ssl.SSLContext | None:
    """Returns the TLS context with the trusted certificates and the client's own; None for an address without TLS."""
    if not to.secure:
        if ca is not None or certificate is not None:
            refuse(
                CallError,
                f"{to} does not use TLS, so a certificate cannot be used",
                "write https://HOST:PORT, or omit ca= and certificate=",
            )
        return None
    trusted, own = ca or os.environ.get("OPENGPAC_CA"), certificate or os.environ.get("OPENGPAC_CERTIFICATE")
    try:
        context = ssl.create_default_context(cafile=trusted)
        if own:
            context.load_cert_chain(own)
    except OSError as error:
        files = " and ".join(f"'{file}'" for file in (trusted, own) if file)
        refuse(CallError, f"cannot load the certificates from {files}: {error}", "pass files in PEM format")
    return context
