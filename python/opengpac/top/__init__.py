# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac top` shows the live state of a real-time system: processors, sources, blocks by time, verbs, devices, alarms."""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import Any

from ..errors import CallError, OutOfRange, refuse
from ..remote.calls import Remote
from ..remote.opening import open_session
from ..remote.session import Session
from .board import ORDERS, View, board
from .finding import FoundDaemon, daemons
from .look import Look, Watch

_LEAST_S, _MOST_S = 0.1, 60.0


def add_to(commands: Any) -> None:
    """Adds the command to the parser."""
    top = commands.add_parser("top", help="show a live table of a daemon: processors, sources, block times, verbs, devices, alarms")
    top.add_argument("where", nargs="?", metavar="URL", help="URL or name of the daemon (default: the one that this user runs)")
    top.add_argument("--name", help="name of the daemon, if this user runs several")
    top.add_argument("--token", help="token for a daemon on a port (default: OPENGPAC_TOKEN)")
    top.add_argument("--every", type=float, default=1.0, metavar="SECONDS", help="interval between two updates, 0.1 to 60 (default: 1)")
    top.add_argument("--sort", choices=ORDERS, default=ORDERS[0], help="order of the blocks (default: %(default)s)")
    top.add_argument("--filter", default="", metavar="TEXT", help="show only lines with this text")
    top.add_argument("--once", action="store_true", help="print the table once and exit, as without a terminal")
    top.add_argument("--json", action="store_true", help="print the table once, as JSON")
    top.add_argument("--no-probe", action="store_true", help="do not measure block times, at no cost to the system")
    top.set_defaults(run=_top)


def _top(given: argparse.Namespace) -> int:
    if not _LEAST_S <= given.every <= _MOST_S:
        refuse(OutOfRange, f"--every must be from {_LEAST_S:g} to {_MOST_S:g} s, not {given.every:g}")
    try:
        session = open_session(url_of(given.where, given.name), None, token=given.token, command=False)
        try:
            return _shown(given, session)
        finally:
            session.close()
    except KeyboardInterrupt:
        return 0


def _shown(given: argparse.Namespace, session: Session) -> int:
    watch = Watch(Remote(session), given.every, probe=not given.no_probe)
    view = View(given.sort, given.filter)
    if given.json or given.once or not (sys.stdin.isatty() and sys.stdout.isatty()):
        watch.look()
        # The interval between two looks counts as the present.
        time.sleep(given.every)
        look, before = watch.look()
        if given.json:
            print(json.dumps({"system": session.version["system"], **look.json(before)}, indent=2))
        else:
            print_once(look, before, view)
        return 0
    from .screen import Screen

    Screen(watch, view, session.version["system"]).run()
    return 0


def print_once(look: Look, before: Look | None, view: View) -> None:
    """Prints the tables, coloured if standard output is a terminal."""
    from rich.console import Console

    console = Console()
    if console.is_terminal:
        console.print(board(look, before, view))
    else:
        print(board(look, before, view))


def url_of(where: str | None, name: str | None) -> str:
    """Returns the URL of the daemon: the specified one, the one with that name, or the only one that this user runs."""
    if where is not None and "://" in where:
        return where
    wanted = name or where
    found = daemons()
    if wanted is not None:
        found = [daemon for daemon in found if daemon.name == wanted]
    if len(found) == 1:
        return found[0].url
    if not found:
        what = "no daemon" if wanted is None else f"no daemon named '{wanted}'"
        refuse(CallError, f"this user runs {what}", "start one with opengpac rts, or give the URL that it printed")
    refuse(CallError, f"this user runs {len(found)} daemons: {_listed(found)}", "choose one with --name, or give its URL")


def _listed(found: list[FoundDaemon]) -> str:
    return ", ".join(f"{daemon.name} ({daemon.url})" for daemon in found)
