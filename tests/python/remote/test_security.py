# SPDX-License-Identifier: Apache-2.0
"""A port with tokens, roles and TLS, from a programming system's point of view."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from daemons import PATIENCE_S, Daemon, environment

CERTIFICATES = Path(__file__).parent / "certificates"


def token(folder: Path, role: str) -> str:
    """Returns a new token of that role."""
    words = ["token", "new", "--tokens", str(folder / "tokens.json"), "--role", role, "--name", f"who may {role}".replace(" ", "-")]
    done = subprocess.run([sys.executable, "-m", "opengpac", *words], env=environment(), capture_output=True, text=True, check=True)
    return done.stdout.split()[-1]


def key(folder: Path) -> Path:
    """Returns the server's key, readable only by its owner."""
    own = folder / "server.key"
    own.write_bytes((CERTIFICATES / "server.key").read_bytes())
    own.chmod(0o600)
    return own


@pytest.fixture
def on_a_port(tmp_path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Yields the URL of a daemon on a port of this host, and a token for each role."""
    tokens = {role: token(tmp_path, role) for role in ("observe", "operate", "configure", "download")}
    made = Daemon(tmp_path, "virtual", "--listen", "127.0.0.1:0", "--tokens", str(tmp_path / "tokens.json"))
    yield next(url for url in made.urls if url.startswith("http")), tokens
    made.stop()


@pytest.fixture
def with_tls(tmp_path: Path) -> Iterator[tuple[str, str]]:
    """Yields the URL of a daemon on a port with TLS, and a token."""
    made_token = token(tmp_path, "download")
    files = ["--tls-cert", str(CERTIFICATES / "server.pem"), "--tls-key", str(key(tmp_path))]
    made = Daemon(tmp_path, "virtual", "--listen", "127.0.0.1:0", "--tokens", str(tmp_path / "tokens.json"), *files)
    yield next(url for url in made.urls if url.startswith("https")), made_token
    made.stop()


def test_a_role_does_what_it_may(on_a_port: tuple[str, dict[str, str]], tmp_path: Path) -> None:
    url, tokens = on_a_port
    with gpac.connect(url, token=tokens["configure"], name="configures") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        cell.svv("level", initial=1.0)
        (tmp_path / "one.c").write_text("#include <opengpac.h>\n")
        with pytest.raises(gpac.NotAllowed, match="download"):
            cell.download(tmp_path / "one.c")
    with gpac.connect(url, token=tokens["operate"], name="operates") as cell:
        assert cell.session is not None and cell.session.role == "operate"
        cell.svv("level").value = 2.0
        with pytest.raises(gpac.NotAllowed, match="configure") as caught:
            cell.processor("rtp1")
        assert isinstance(caught.value, PermissionError)
    with gpac.connect(url, token=tokens["observe"], command=False) as cell:
        assert cell.svv("level").value == 2.0
        with pytest.raises(gpac.NotAllowed):
            cell.svv("level").value = 3.0


def test_without_a_token_nobody_gets_in(on_a_port: tuple[str, dict[str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    url, tokens = on_a_port
    monkeypatch.delenv("OPENGPAC_TOKEN", raising=False)
    with pytest.raises(gpac.NotAllowed):
        gpac.connect(url, name="nobody")
    with pytest.raises(gpac.NotAllowed):
        gpac.connect(url, name="nobody", token=tokens["operate"][:-1] + "x")
    monkeypatch.setenv("OPENGPAC_TOKEN", tokens["operate"])
    with gpac.connect(url, name="somebody") as cell:
        assert cell.session is not None and cell.session.role == "operate"


def test_tls_with_an_authority_that_is_trusted(with_tls: tuple[str, str]) -> None:
    url, given = with_tls
    with gpac.connect(url, token=given, ca=CERTIFICATES / "ca.pem") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        cell.advance("1 s")
        assert cell.now == 1.0


def test_tls_with_an_authority_that_is_not_trusted(with_tls: tuple[str, str]) -> None:
    url, given = with_tls
    with pytest.raises(gpac.ConnectionLost, match="its certificate is not accepted"):
        gpac.connect(url, token=given)


def test_a_client_certificate(tmp_path: Path) -> None:
    words = ["token", "new", "--tokens", str(tmp_path / "tokens.json"), "--role", "operate", "--name", "panel"]
    command = [sys.executable, "-m", "opengpac", *words, "--certificate", str(CERTIFICATES / "client.pem")]
    subprocess.run(command, env=environment(), check=True, capture_output=True)
    files = ["--tls-cert", str(CERTIFICATES / "server.pem"), "--tls-key", str(key(tmp_path))]
    options = ["--listen", "127.0.0.1:0", "--tokens", str(tmp_path / "tokens.json"), "--client-ca", str(CERTIFICATES / "ca.pem"), *files]
    made = Daemon(tmp_path, "virtual", *options)
    url = next(url for url in made.urls if url.startswith("https"))
    with gpac.connect(url, ca=CERTIFICATES / "ca.pem", certificate=CERTIFICATES / "client.pem") as cell:
        assert cell.session is not None and cell.session.role == "operate"
    made.stop()


def test_who_is_revoked_hears_why_it_is_out(on_a_port: tuple[str, dict[str, str]], tmp_path: Path) -> None:
    url, tokens = on_a_port
    cell = gpac.connect(url, token=tokens["operate"], name="operates")
    words = ["token", "revoke", "who-may-operate", "--tokens", str(tmp_path / "tokens.json")]
    subprocess.run([sys.executable, "-m", "opengpac", *words], env=environment(), capture_output=True, check=True)
    cell.session._alive.join(PATIENCE_S)
    assert cell.session.lost
    with pytest.raises(gpac.ConnectionLost, match="the token was revoked"):
        cell.emergency_stop("too late")
    cell.close()
