# SPDX-License-Identifier: Apache-2.0
"""A private component database for each test, independent of this machine's user."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from opengpac import library
from opengpac.library.catalogue import Catalogue


@pytest.fixture
def database(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Catalogue]:
    """Provides an empty user configuration, no OPENGPAC_PATH, and a new catalogue."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "configuration"))
    monkeypatch.delenv("OPENGPAC_PATH", raising=False)
    fresh = Catalogue()
    monkeypatch.setattr(library, "CATALOGUE", fresh)
    yield fresh
