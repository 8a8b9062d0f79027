# SPDX-License-Identifier: Apache-2.0
"""A page of two files in place of the built one, and plain requests to its server."""

from __future__ import annotations

from pathlib import Path

import pytest

from opengpac.studio import server


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns the folder of a page, which replaces the package's own in this test."""
    folder = tmp_path / "page"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<!doctype html><html><title>studio</title></html>")
    (folder / "assets" / "index-1f2e.js").write_text("export {};")
    monkeypatch.setattr(server, "PAGE", folder)
    return folder
