# SPDX-License-Identifier: Apache-2.0
"""Systems with several hosts: a host that listens for others, and `opengpac join`, which adds a host to a system."""

from __future__ import annotations

import argparse
import json
import platform
import signal
import sys
from pathlib import Path
from typing import Any

from .. import _native
from ..errors import refusals
from ..values.quantities import Quantity, duration_ns


def options(
    endpoint: str,
    name: str,
    *,
    authority: str | Path | None = None,
    certificate: str | Path | None = None,
    key: str | Path | None = None,
    token: str | None = None,
    clock_limit: Quantity | None = None,
) -> dict[str, Any]:
    """Returns the options with which a host listens or joins, in the core's format."""
    files = {"authority": authority, "certificate": certificate, "key": key}
    given: dict[str, Any] = {what: str(Path(file).expanduser().absolute()) for what, file in files.items() if file is not None}
    if token is not None:
        given["token"] = token
    if clock_limit is not None:
        given["clock_limit_ns"] = duration_ns(clock_limit, "the limit of the clocks")
    return {"endpoint": endpoint, "name": name, **given}


def host_name() -> str:
    """Returns this host's name, reduced to characters that are valid in a host name."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "-" for c in platform.node())[:64] or "host"


def add_to(commands: Any) -> None:
    """Adds the command `join` to `opengpac`."""
    join = commands.add_parser("join", help="run processors of a remote system (those with host=NAME) on this host")
    join.add_argument("--system", required=True, help="name of the system")
    join.add_argument(
        "--at", required=True, metavar="tcp/HOST:PORT", help="address at which it listens; tls/HOST:PORT if on another machine"
    )
    join.add_argument("--name", default=host_name(), help="name of this host (default: %(default)s)")
    join.add_argument("--ca", metavar="FILE", help="certificate of the authority (PEM), for tls/")
    join.add_argument("--cert", metavar="FILE", help="this host's certificate (PEM), for tls/")
    join.add_argument("--key", metavar="FILE", help="its private key (PEM), readable by its owner only")
    join.add_argument(
        "--token-file", metavar="FILE", help="file with the secret of the system (default: that of this user, or certificates)"
    )
    join.set_defaults(run=_join)


def _join(given: argparse.Namespace) -> int:
    token = Path(given.token_file).read_text().strip() if given.token_file else None
    asked = options(given.at, given.name, authority=given.ca, certificate=given.cert, key=given.key, token=token)
    # A service manager ends it by this signal; the effect is that of Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        print(f"host '{given.name}' joins system '{given.system}' at {given.at}; end it with Ctrl-C", flush=True)
        with refusals:
            why = _native.join_system(given.system, json.dumps(asked))
        end = f"system '{given.system}' has ended"
    except KeyboardInterrupt:
        why, end = None, f"host '{given.name}' has left"
    if why is not None:
        print(why, file=sys.stderr)
        return 1
    print(f"{end}; the devices are in their safe state")
    return 0
