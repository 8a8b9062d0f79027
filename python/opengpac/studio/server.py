# SPDX-License-Identifier: Apache-2.0
"""The studio: a page in a browser that shows a running system, and the commands that serve it. `docs/studio.md` is its manual.

Threads of the real-time core serve the page, in this process or in the daemon's, so that it remains responsive while Python is busy.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import tempfile
import time
import webbrowser
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self
from urllib.parse import urlsplit

from .. import _native, checking
from ..errors import CallError, FileFailed, NotAllowed, refusals, refuse
from ..storage.cache import user_data
from ..system import open_systems, programs

if TYPE_CHECKING:
    from ..system.observation import SystemObservation
    from ..system.system import System

PAGE = Path(__file__).parents[1] / "studio_page"
"""Files of the page, as built by `npm run build` and shipped in the wheel."""

ROLES = ("observe", "operate", "configure")
"""Roles of the page, by increasing privileges: watch; start, halt and enable; install edited definitions."""

_ANSWER_S = 10.0


class Studio:
    """Page of a system while it is served: its address, and methods to open and stop it. Returned by `cell.studio()`."""

    def __init__(self, system: str, url: str, role: str | None, server: _native.Server | None = None) -> None:
        self.system = system
        """Name of the displayed system."""
        self.url = url
        """Address of the page, with the token of this run; a browser that has the token has the permissions of `role`."""
        self.role = role
        """Role: `observe`, `operate` or `configure`; None if a daemon determines it from the caller."""
        self._server = server
        self._pointer: tempfile.TemporaryDirectory[str] | None = None

    @property
    def closed(self) -> bool:
        """True if the page is no longer served."""
        return not self.url

    def stop(self) -> None:
        """Stops serving the page, and invalidates its token. Idempotent. Does not stop a daemon's page."""
        self.url = ""
        if self._server is not None:
            self._server.stop()
        if self._pointer is not None:
            self._pointer.cleanup()
            self._pointer = None

    def open(self) -> bool:
        """Opens the page in a browser on this machine; returns False if there is no browser, or no display for it.

        The address is passed in a file that only this user can read, because the command line of a browser is visible to other users.
        """
        if not self.url or not _has_screen():
            return False
        self._pointer = self._pointer or tempfile.TemporaryDirectory(prefix="opengpac-studio-")
        file = Path(self._pointer.name) / "studio.html"
        file.touch(mode=0o600)
        file.write_text(f'<!doctype html><meta http-equiv="refresh" content="0; url={escape(self.url)}"><title>studio</title>\n')
        return webbrowser.open(file.as_uri())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"studio of system '{self.system}': {self.url or 'stopped'}"

    def _repr_html_(self) -> str:
        if not self.url:
            return f"studio of system '{escape(self.system)}': stopped"
        return f'<a href="{escape(self.url)}" target="_blank" rel="noopener">studio of system &#x27;{escape(self.system)}&#x27;</a>'


def serve(system: SystemObservation, port: int, role: str, audit: str | None = None, page: Path | None = None) -> Studio:
    """Serves the page of a system of this process. Raises `FileFailed` if it was not built, `InUse` if the port is in use."""
    if not isinstance(port, int) or isinstance(port, bool) or not 0 <= port <= 65535:
        refuse(CallError, f"the port of a studio must be from 1024 to 65535, not {port!r}", "pass 0 for any free port")
    if role not in ROLES:
        refuse(CallError, f"the role of a studio cannot be {role!r}", f"pass one of {', '.join(map(repr, ROLES))}")
    embedded = system._alive()
    if checking.active() or not isinstance(embedded, _native.System):
        return Studio(system.name, "", role)
    options: dict[str, Any] = {"no_socket": True, "listen": f"127.0.0.1:{port}", "run_token": role, "page": str(built(page))}
    if audit is not None:
        options["audit"] = audit
    if may_record(role) and (records := records_of_user()) is not None:
        options["records"] = records
    with refusals:
        server = _native.Server(embedded, json.dumps(options))
    return Studio(system.name, server.studio() or "", role, server)


def may_record(role: str) -> bool:
    """Returns whether a page with this role may start recordings."""
    return role != "observe"


def records_of_user() -> str | None:
    """Returns the default folder for recordings of a page, in `$XDG_DATA_HOME` or `~/.local/share`; creates it if necessary. Returns
    None if that fails."""
    try:
        folder = user_data() / "recordings"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        # The user has no home, or it is not writable.
        return None
    return str(folder)


def built(page: Path | None = None) -> Path:
    """Returns the folder of the page's files. Raises `FileFailed` if they do not exist, as in a checkout in which the page has not been
    built."""
    folder = page or PAGE
    if not (folder / "index.html").is_file():
        remedy = "build it in the sources with `make page`, which needs Node 20.19 or newer, or install a wheel, which contains it"
        refuse(FileFailed, f"the studio's page is not in '{folder}'", remedy)
    return folder


def of_daemon(system: SystemObservation) -> Studio:
    """Returns the page that a daemon serves itself. Raises `NotAllowed` if the daemon serves no page, or if a browser cannot reach its
    address."""
    session = system.session
    assert session is not None
    remedy = "start it with --listen 127.0.0.1:8777 --tokens FILE, or --studio, and open the address that it prints"
    if urlsplit(session.url).scheme == "unix":
        refuse(NotAllowed, f"system '{system.name}' is reached through a Unix socket, which a browser cannot open", remedy)
    there = session.transport.request("GET", "/", timeout_s=_ANSWER_S)
    if there.status != 200 or b"<html" not in there.body.lower():
        refuse(NotAllowed, f"the daemon at {session.url} does not serve a page", remedy)
    token = session.transport.token
    return Studio(system.name, f"{session.url.rstrip('/')}/{f'#token={token}' if token else ''}", None)


def _has_screen() -> bool:
    """Returns whether a graphical browser can be opened; without a display, a text browser would open in the program's terminal."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


# ---- opengpac studio PROGRAM.py


# Python registers a signal that arrives just before a sleep, and handles it when that sleep ends. Therefore sleeps must be short.
_SLICE_S = 0.2


class _Shown(programs.Watcher):
    """Watcher that serves the page of every system of the program."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.port: int = given.port
        self.role: str = "configure" if given.edit else given.role
        self.page = None if given.page is None else Path(given.page)
        self.browser: bool = not given.no_browser
        self.program: str = given.program

    def made(self, system: System) -> None:
        if system.session is not None:
            return
        studio = system._served(serve(system, self.port, self.role, page=self.page))
        # A second system needs a separate address.
        self.port = 0
        print(f"studio: {studio.url}", flush=True)
        if self.browser:
            studio.open()

    def left(self, system: System) -> None:
        # Continue until Ctrl-C.
        if not system.closed:
            print(f"'{self.program}' has finished with system '{system.name}', which keeps running; end it with Ctrl-C", flush=True)
            while True:
                time.sleep(_SLICE_S)


def add_to(commands: Any) -> None:
    """Adds the command `studio` to `opengpac`."""
    parser = commands.add_parser("studio", help="run a program and serve the page of its system until Ctrl-C")
    parser.add_argument("--port", type=int, default=0, help="port of 127.0.0.1 (default: any that is free)")
    parser.add_argument("--role", choices=ROLES, default="operate", help="role of the page (default: operate)")
    parser.add_argument("--edit", action="store_true", help="let the page install edited definitions, too")
    parser.add_argument("--no-browser", action="store_true", help="only print the address, without opening a browser")
    parser.add_argument("--page", metavar="FOLDER", help="folder with other files of the page than those of OpenGPAC")
    programs.add_to(parser)
    parser.set_defaults(run=_studio)


def _studio(given: argparse.Namespace) -> int:
    # Check before the program runs: it must not move a machine for a missing page.
    built(None if given.page is None else Path(given.page))
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    shown = _Shown(given)
    code: int | str | None = 0
    try:
        with programs.watched(shown):
            try:
                programs.run(given)
            except SystemExit as ended:
                code = ended.code
            for left in open_systems.systems():
                shown.left(left)
    except KeyboardInterrupt:
        code = 0
    finally:
        for left in open_systems.systems():
            left.close()
    if isinstance(code, str):
        print(code, file=sys.stderr)
        return 1
    return code or 0
