# SPDX-License-Identifier: Apache-2.0
"""Valid addresses of a system, and the refusals of invalid ones."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac.remote.address import address


def test_the_three_forms() -> None:
    assert address("unix:///run/cell.sock").path == "/run/cell.sock"
    plain = address("http://127.0.0.1:8777")
    assert (plain.host, plain.port, plain.secure, plain.path) == ("127.0.0.1", 8777, False, "")
    assert address("https://cell-b:8777/").secure
    assert address("https://[::1]:8777").host == "::1"


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("ftp://cell:21", "is not the URL of a system: its scheme cannot be 'ftp'"),
        ("htps://cell:8777", "did you mean 'https'"),
        ("cell", "write unix:///path.sock"),
        (7, "must be a string, not 7"),
        ("http://127.0.0.1", "write a host and a port only"),
        ("http://127.0.0.1:70000", "port out of range"),
        ("http://127.0.0.1:8777/v1", "write a host and a port only"),
        ("http://127.0.0.1:8777?token=secret", "never in the URL"),
        ("http://me:secret@127.0.0.1:8777", "never in the URL"),
        ("unix://run/cell.sock", "three slashes"),
        ("unix://", "three slashes"),
    ],
)
def test_what_is_no_address_is_refused(url: Any, says: str) -> None:
    with pytest.raises(gpac.CallError, match=says.replace("?", r"\?")) as caught:
        gpac.connect(url)
    assert caught.value.file == __file__


def test_a_url_is_no_name_of_a_system() -> None:
    with pytest.raises(gpac.CallError, match=r"connect to that system: gpac\.connect\('unix:///cell\.sock'\)"):
        gpac.System("unix:///cell.sock")


def test_where_nobody_answers_it_says_how_to_start_one(tmp_path: Path) -> None:
    with pytest.raises(gpac.ConnectionLost, match=r"no system answers at .*: no such file or directory; .*opengpac rts") as caught:
        gpac.connect(f"unix://{tmp_path}/nobody.sock")
    assert caught.value.file == __file__ and isinstance(caught.value, ConnectionError)


@pytest.fixture
def foreign() -> Iterator[Any]:
    """Yields a web server that is not a control interface; its `answer` is its response to every request."""

    class Foreign(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            status, text = server.answer  # type: ignore[attr-defined]
            self.send_response(status)
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        def log_message(self, *_: Any) -> None:
            return

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Foreign)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.mark.parametrize("answer", [(200, b"hello"), (404, b"<html>"), (500, b'{"error": 1}'), (200, b"{}")])
def test_a_web_server_that_is_no_control_interface(foreign: Any, answer: tuple[int, bytes]) -> None:
    foreign.answer = answer
    with pytest.raises(gpac.Error, match=r"does not come from a control interface|has OpenGPAC None"):
        gpac.connect(f"http://127.0.0.1:{foreign.server_port}")


@pytest.mark.parametrize(
    "version", [b'{"opengpac": "9.7.0", "interface": 1, "system": "cell"}', b'{"opengpac": "0.1.0", "interface": 2, "system": "cell"}']
)
def test_versions_that_do_not_fit_are_refused_in_words(foreign: Any, version: bytes) -> None:
    foreign.answer = (200, version)
    with pytest.raises(gpac.VersionMismatch, match=r"has OpenGPAC .* interface .*, but this program has OpenGPAC .*; install the same"):
        gpac.connect(f"http://127.0.0.1:{foreign.server_port}")


def test_certificates_are_for_addresses_with_tls(tmp_path: Path) -> None:
    with pytest.raises(gpac.CallError, match="does not use TLS"):
        gpac.connect("http://127.0.0.1:8777", ca=tmp_path / "ca.pem")
    with pytest.raises(gpac.CallError, match=r"cannot load the certificates from '.*ca\.pem'"):
        gpac.connect("https://127.0.0.1:8777", ca=tmp_path / "ca.pem")
