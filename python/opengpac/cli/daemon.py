# SPDX-License-Identifier: Apache-2.0
"""The commands `opengpac rts` and `opengpac token`, which run a real-time system as a daemon and manage access to it."""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import sys
import time
from pathlib import Path
from typing import Any

from .. import _native
from ..drivers.simulated import mujoco_folder
from ..errors import CallError, FileFailed, refusals, refuse
from ..studio import offered_motions, server
from ..system import open_systems, programs, system

_DESCRIPTORS = 8192
_ROLES = ("observe", "operate", "configure", "download")
_DAY_S = 86_400


def add_to(commands: Any) -> None:
    """Adds both commands to the parser."""
    rts = commands.add_parser("rts", help="run a real-time system as a daemon; docs/control.md describes its interface")
    rts.add_argument("--name", help="name of the system (default: cell)")
    rts.add_argument("--clock", choices=["monotonic", "virtual"], help="clock of the system (default: monotonic)")
    rts.add_argument("--seed", type=int, help="seed of preemptions and faults under the virtual clock")
    rts.add_argument("--socket", metavar="PATH", help="path of the Unix socket (default: in a private folder)")
    rts.add_argument(
        "--listen", metavar="HOST:PORT", help="also listen on TCP; an address that is not loopback needs TLS and authenticated callers"
    )
    rts.add_argument("--tls-cert", metavar="PEM", help="certificate of the daemon")
    rts.add_argument("--tls-key", metavar="PEM", help="private key of the certificate")
    rts.add_argument("--client-ca", metavar="PEM", help="certificate of the authority that signs client certificates")
    rts.add_argument("--tokens", metavar="FILE", help="token file, created by opengpac token new")
    rts.add_argument("--audit", metavar="FILE", help="audit log, which is appended to (default: beside the socket)")
    rts.add_argument("--journal", metavar="FILE", help="log of the calls that configured the system; a restarted daemon repeats them")
    rts.add_argument("--journal-strict", action="store_true", help="fail the start if a call of the journal fails")
    rts.add_argument("--records", metavar="FOLDER", help="folder in which remote programs and pages may record")
    rts.add_argument(
        "--trust", action="append", default=[], metavar="SHA256",
        help="digest of native code that may run when a recording with it is replayed; modules that the system has had are always allowed",
    )  # fmt: skip
    rts.add_argument("--insecure-loopback", action="store_true", help="let any user of this machine observe over TCP without a token")
    rts.add_argument("--host", action="append", default=[], metavar="NAME", help="name that requests may use for this machine")
    rts.add_argument("--origin", action="append", default=[], metavar="URL", help="site whose pages may send requests")
    rts.add_argument("--studio", action="store_true", help="print the address of the page with a token for this run")
    rts.add_argument("--studio-role", choices=server.ROLES, help="role of that token (default: operate)")
    rts.add_argument("--page", metavar="FOLDER", help="folder with other files of the page than those of OpenGPAC")
    programs.add_to(rts, nargs="?", help="program to run first; the system that it leaves open is served")
    rts.set_defaults(run=_rts)
    token = commands.add_parser("token", help="manage access to a daemon").add_subparsers(required=True, metavar="ACTION")
    new = token.add_parser("new", help="make a token and print it once")
    new.add_argument("--name", required=True, help="name of its owner")
    new.add_argument("--role", required=True, choices=_ROLES)
    new.add_argument("--days", type=float, help="validity in days (default: until it is revoked)")
    new.add_argument("--certificate", metavar="PEM", help="admit the holder of this client certificate instead")
    new.set_defaults(run=_token_new)
    shown = token.add_parser("list", help="list the tokens")
    shown.set_defaults(run=_token_list)
    revoke = token.add_parser("revoke", help="revoke a token")
    revoke.add_argument("name")
    revoke.set_defaults(run=_token_revoke)
    for parser in (new, shown, revoke):
        parser.add_argument("--tokens", metavar="FILE", default="tokens.json", help="token file (default: tokens.json)")


def _rts(given: argparse.Namespace) -> int:
    # Terminate the daemon in order, as by Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    # On log rotation or a new certificate it continues with its files reopened.
    hung_up: list[int] = []
    signal.signal(signal.SIGHUP, lambda number, _: hung_up.append(number))

    def rereads() -> bool:
        asked = bool(hung_up)
        hung_up.clear()
        return asked

    _take_descriptors()
    # This system is the one that others connect to.
    os.environ.pop("OPENGPAC_SYSTEM", None)
    # Remote programs send their models without the path of the library: that belongs to this machine.
    library = mujoco_folder()
    if library is not None:
        os.environ["OPENGPAC_MUJOCO"] = library
    options = {
        "socket": given.socket, "listen": given.listen, "tls_cert": given.tls_cert, "tls_key": given.tls_key,
        "client_ca": given.client_ca, "tokens": given.tokens, "audit": given.audit,
        "journal": given.journal, "journal_strict": given.journal_strict, "records": _records(given), "trust": given.trust,
        "insecure_loopback": given.insecure_loopback, "hosts": given.host, "origins": given.origin,
        **_studio(given),
    }  # fmt: skip
    try:
        served = _of_program(given) if given.program else _of_words(given)
        if given.studio:
            offered_motions.offer(served, given.studio_role or "operate")
        embedded = served._alive()
        assert isinstance(embedded, _native.System)
        with served, refusals:
            _native.serve(embedded, json.dumps({k: v for k, v in options.items() if v is not None}), _tell, _say, rereads)
    except KeyboardInterrupt:
        pass
    return 0


def _take_descriptors() -> None:
    """Raises the limit on open descriptors as far as permitted, to allow for many clients."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _DESCRIPTORS if hard == resource.RLIM_INFINITY else min(hard, _DESCRIPTORS)
    if soft not in (resource.RLIM_INFINITY, hard) and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _say(addresses: list[str], page: str | None) -> None:
    for address in addresses:
        print(f"listening on {address}", flush=True)
    if page is not None:
        print(f"studio: {page}", flush=True)


def _studio(given: argparse.Namespace) -> dict[str, Any]:
    """Returns the options for serving the studio: the page if a port is set and the page was built, and a token for this run if
    requested."""
    if given.studio_role is not None and not given.studio:
        refuse(CallError, "--studio-role needs a page with a token", "add --studio")
    page = None if given.page is None else Path(given.page)
    if given.studio:
        return {"listen": given.listen or "127.0.0.1:0", "page": str(server.built(page)), "run_token": given.studio_role or "operate"}
    served = given.listen is not None and (page is not None or (server.PAGE / "index.html").is_file())
    return {"page": str(server.built(page))} if served else {}


def _records(given: argparse.Namespace) -> str | None:
    """Returns the directory for recordings: the specified one, or the user's own if the studio may record and nobody else is admitted;
    otherwise None."""
    is_shared = given.tokens is not None or given.client_ca is not None
    if given.records is not None or is_shared or not given.studio or not server.may_record(given.studio_role or "operate"):
        return given.records
    return server.records_of_user()


def _of_words(given: argparse.Namespace) -> system.System:
    return system.System(given.name or "cell", given.clock or "monotonic", seed=given.seed or 0, adopt=given.journal is not None)


def _of_program(given: argparse.Namespace) -> system.System:
    """Runs the program and returns the single system that it leaves open."""
    for word in ("name", "clock", "seed"):
        if getattr(given, word) is not None:
            refuse(
                CallError,
                f"--{word} cannot be combined with program '{given.program}', which creates the system itself",
                "set it in the program",
            )
    made = programs.run(given, "opengpac.rts")
    there = [s for s in open_systems.systems() if not s.closed and any(s is value for value in made.values())]
    if len(there) != 1:
        left = f"program '{given.program}' leaves {len(there)} systems open"
        refuse(CallError, left, "assign exactly one to a global name, without 'with'")
    return there[0]


def _token_new(given: argparse.Namespace) -> int:
    expires = None if given.days is None else int(time.time() + given.days * _DAY_S)
    try:
        with refusals:
            token = _native.token_new(given.tokens, given.name, given.role, expires, given.certificate)
    except OSError as why:
        refuse(FileFailed, f"cannot use the token file: {why}")
    print(token or f"the certificate has the role '{given.role}'")
    return 0


def _token_list(given: argparse.Namespace) -> int:
    try:
        with refusals:
            entries = json.loads(_native.token_list(given.tokens))
    except OSError as why:
        refuse(FileFailed, f"cannot use the token file: {why}")
    for entry in entries:
        state = "revoked" if entry["revoked"] else "expired" if entry["expires"] and entry["expires"] <= time.time() else "valid"
        what = "certificate" if entry["certificate"] else "token"
        print(f"{entry['name']:<20} {entry['role']:<10} {what:<12} {state}")
    return 0


def _token_revoke(given: argparse.Namespace) -> int:
    try:
        with refusals:
            revoked = _native.token_revoke(given.tokens, given.name)
    except OSError as why:
        refuse(FileFailed, f"cannot use the token file: {why}")
    print(f"token '{given.name}' has been revoked" if revoked else f"there is no valid token '{given.name}'")
    return 0 if revoked else 1
