# SPDX-License-Identifier: Apache-2.0
"""The documentation site: docs/README.md lists every page under one of four kinds, each page begins with its benefit to the reader, and
anchors exist.

`make docs` builds the site and checks its links with Sphinx; no test here needs Sphinx.
"""

from __future__ import annotations

import functools
import importlib.util
import re
from pathlib import Path

import pytest
from listings import ROOT

DOCS = ROOT / "docs"
FRONT = DOCS / "README.md"
KINDS = ["Tutorials", "How-to guides", "Explanation", "Reference"]
FIRST_SCREEN = 45
"""Number of lines of a page that fit in a window."""

_FENCE = re.compile(r"^(```+).*?^\1$", re.DOTALL | re.MULTILINE)
_ANCHOR = re.compile(r"\]\((?!https?://)([^)#\s]*)#([^)\s]+)\)")


def of_kind(kind: str) -> list[Path]:
    """Returns the pages that the front page lists under a kind."""
    text = FRONT.read_text().split(f"\n## {kind}\n")[1].split("\n## ")[0]
    return [DOCS / f"{name}.md" for name in re.findall(r"^- \[[^\]]+\]\(([\w./-]+)\.md\)", text, re.MULTILINE)]


@functools.cache
def anchors(page: Path) -> set[str]:
    """Returns the anchors of a page's headings, as MyST and GitHub generate them."""
    titles = re.findall(r"^#{1,6} (.+)$", _FENCE.sub("", page.read_text()), re.MULTILINE)
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title) for title in titles]
    return {re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-") for title in plain}


PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md", ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md"]


def test_front_page_names_each_page() -> None:
    named = {page for kind in KINDS for page in of_kind(kind)}
    made = {*(DOCS / "reference").glob("*.md"), *(DOCS / "decisions").glob("[0-9]*.md")}
    assert {*DOCS.rglob("*.md")} - made - named == {FRONT}
    assert not {page for page in named if not page.exists()}


@pytest.mark.parametrize(
    ("asked", "page"),
    [
        ("install OpenGPAC", "install.md"),
        ("first motion", "first-motion.md"),
        ("write a block", "blocks.md"),
        ("write a driver", "drivers/writing.md"),
        ("port mode", "blocks.md#modes-of-ports"),
        ("effect of a fault", "guard.md"),
        ("record a run and replay", "replay.md"),
        ("connect a UR", "drivers/ur.md"),
        ("as a service", "install.md#as-a-service"),
        ("error at a start", "errors.md#which-error-comes-when"),
    ],
)
def test_front_page_answers_what_a_newcomer_asks_first(asked: str, page: str) -> None:
    first = FRONT.read_text().split("\n## ")[0]
    (row,) = [line for line in first.splitlines() if line.startswith("| ") and asked in line]
    assert f"]({page})" in row


def test_index_of_the_reference_names_each_of_its_pages() -> None:
    named = {*re.findall(r"\]\(reference/([\w-]+\.md)\)", (DOCS / "reference.md").read_text())}
    assert named == {page.name for page in (DOCS / "reference").glob("*.md")}


def test_site_has_a_table_of_contents_for_each_kind() -> None:
    spec = importlib.util.spec_from_file_location("conf", DOCS / "conf.py")
    assert spec and spec.loader
    conf = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(conf)
    made = conf.tables_of_contents(FRONT.read_text())
    assert re.findall(r":caption: (.+)", made) == KINDS
    assert re.findall(r"^.+ <(.+)>$", made, re.MULTILINE) == [
        page.relative_to(DOCS).with_suffix("").as_posix() for kind in KINDS for page in of_kind(kind)
    ]


@pytest.mark.parametrize("page", [*of_kind("Tutorials"), *of_kind("How-to guides")], ids=lambda page: page.stem)
def test_page_begins_with_what_one_gets(page: Path) -> None:
    screen = "\n".join(page.read_text().splitlines()[:FIRST_SCREEN])
    fences = re.findall(r"^```(\w+)\n(.*?)(?:^```|\Z)", screen, re.MULTILINE | re.DOTALL)
    printed = any(word == "text" or (word == "console" and re.search(r"^(?!\$)", text.strip(), re.MULTILINE)) for word, text in fences)
    shown = printed or re.search(r"^!\[|^\| .*!\[|^<!-- output -->", screen, re.MULTILINE)
    assert shown, f"{page.name} shows no picture and no output in its first {FIRST_SCREEN} lines"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_anchor_that_a_page_names_exists(page: Path) -> None:
    text = _FENCE.sub("", page.read_text())
    targets = [((page.parent / link).resolve() if link else page, anchor) for link, anchor in _ANCHOR.findall(text)]
    missing = [f"{target.name}#{anchor}" for target, anchor in targets if target.suffix == ".md" and anchor not in anchors(target)]
    assert not missing
