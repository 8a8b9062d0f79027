# SPDX-License-Identifier: Apache-2.0
"""`opengpac docs` serves the pages contained in the package."""

from __future__ import annotations

import threading
import urllib.error
import urllib.request
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import cli
from opengpac.cli import docs


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Serves a small site; yields the address of its front page."""
    monkeypatch.setattr(docs, "SITE", tmp_path / "site.zip")
    with zipfile.ZipFile(docs.SITE, "w") as archive:
        archive.writestr("index.html", "<title>front</title>")
        archive.writestr("drivers/ur.html", "<title>é</title>")
        archive.writestr("_static/furo.css", "body {}")
    with docs.server() as made:
        thread = threading.Thread(target=made.serve_forever, args=(0.01,))
        thread.start()
        yield docs.address(made, [])
        made.shutdown()
        thread.join()


@pytest.mark.parametrize(
    ("path", "kind", "body"),
    [
        ("", "text/html; charset=utf-8", "<title>front</title>"),
        ("drivers/ur.html?highlight=robot", "text/html; charset=utf-8", "<title>é</title>"),
        ("_static/furo.css", "text/css; charset=utf-8", "body {}"),
    ],
)
def test_pages_are_served_with_their_kind(site: str, path: str, kind: str, body: str) -> None:
    with urllib.request.urlopen(site + path) as answer:
        assert answer.headers["Content-Type"] == kind
        assert answer.read().decode() == body


@pytest.mark.parametrize("path", ["none.html", "../site.zip", "%2e%2e/site.zip", "drivers/"])
def test_what_is_not_in_the_archive_is_not_found(site: str, path: str) -> None:
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(site + path)


def test_words_lead_to_the_search(site: str) -> None:
    with docs.server() as made:
        assert docs.address(made, ["port", "modes"]).endswith("/search.html?q=port%20modes")


@pytest.mark.parametrize(("content", "said"), [(None, "make docs"), (b"no archive", "is damaged")])
def test_package_without_pages_says_how_to_get_them(
    content: bytes | None, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(docs, "SITE", tmp_path / "site.zip")
    if content is not None:
        docs.SITE.write_bytes(content)
    with pytest.raises(gpac.FileFailed, match=said):
        docs.server()
    assert cli.main(["docs", "--no-open"]) == 1
    assert said in capsys.readouterr().err
