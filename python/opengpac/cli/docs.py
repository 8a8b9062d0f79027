# SPDX-License-Identifier: Apache-2.0
"""The documentation as a site inside the package: `opengpac docs` serves it locally, without network access."""

from __future__ import annotations

import argparse
import mimetypes
import webbrowser
import zipfile
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from ..errors import FileFailed, refuse

SITE = Path(__file__).parents[1] / "docs_site.zip"
"""Archive of the pages, as built by `make docs` and shipped in the wheel."""


def server(port: int = 0) -> ThreadingHTTPServer:
    """Returns an HTTP server for the pages on the loopback interface; `port` 0 selects a free one.

    Raises `FileFailed` if the pages are missing or damaged, and `OSError` if the port is in use.
    """
    if not SITE.exists():
        refuse(
            FileFailed,
            "this installation does not contain the documentation",
            "build it with `make docs` in a checkout, or install a wheel, which contains it",
        )
    try:
        pages = zipfile.ZipFile(SITE)
    except zipfile.BadZipFile:
        refuse(
            FileFailed, f"the documentation in '{SITE}' is damaged", "reinstall the package, or rebuild the documentation with `make docs`"
        )

    class Pages(BaseHTTPRequestHandler):
        """Serves the requested file from the archive."""

        def do_GET(self) -> None:
            name = unquote(urlsplit(self.path).path).lstrip("/") or "index.html"
            try:
                body = pages.read(name)
            except KeyError:
                self.send_error(404, "page not found")
                return
            self.send_response(200)
            self.send_header("Content-Type", _kind(name))
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:
            """Logs nothing."""

    return ThreadingHTTPServer(("127.0.0.1", port), Pages)


def address(made: ThreadingHTTPServer, words: list[str]) -> str:
    """Returns the URL of the front page, or of a search for `words`."""
    front = f"http://127.0.0.1:{made.server_address[1]}/"
    return front + (f"search.html?q={quote(' '.join(words))}" if words else "")


def _kind(name: str) -> str:
    kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command."""
    docs = commands.add_parser("docs", help="serve the documentation offline, until Ctrl-C")
    docs.add_argument("words", nargs="*", metavar="WORD", help="words to search for")
    docs.add_argument("--port", type=int, default=0, help="port (default: any that is free)")
    docs.add_argument("--no-open", action="store_true", help="only print the address, without opening a browser")
    docs.set_defaults(run=_run)


def _run(given: argparse.Namespace) -> int:
    with server(given.port) as made:
        url = address(made, given.words)
        print(url, flush=True)
        if not given.no_open:
            webbrowser.open(url)
        try:
            made.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0
