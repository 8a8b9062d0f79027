# SPDX-License-Identifier: Apache-2.0
"""The targets of a page's links exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from listings import PAGES, ROOT

_LINK = re.compile(r"\]\((?!https?://)([^)#\s]+)")
_WITH_LINKS = [*PAGES, ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md"]


@pytest.mark.parametrize("page", _WITH_LINKS, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    missing = [link for link in _LINK.findall(page.read_text()) if not (page.parent / link).exists()]
    assert not missing


@pytest.mark.parametrize("page", _WITH_LINKS, ids=lambda page: page.name)
def test_every_file_that_a_page_names_in_a_code_span_exists(page: Path) -> None:
    folders = "|".join(["crates", "python", "tests", "examples", "docs", "bench", *(c.name for c in (ROOT / "crates").iterdir())])
    named = re.findall(rf"`((?:{folders})/[\w./-]+)`", page.read_text())
    missing = [path for path in named if not ((ROOT / path).exists() or (ROOT / "crates" / path).exists())]
    assert not missing
