# SPDX-License-Identifier: Apache-2.0
"""The pages docs/reference.md and docs/reference contain every public name, with its present signature and docstring."""

from __future__ import annotations

import importlib
import re
from collections import Counter
from pathlib import Path

import pytest
from reference_page import FOLDER, GROUPS, MODULES, PAGE, pages, public


@pytest.fixture(scope="module")
def made() -> dict[Path, str]:
    """Returns every page, generated once, including the pictures of the blocks."""
    return pages()


def test_the_pages_are_what_the_docstrings_say(made: dict[Path, str]) -> None:
    assert {PAGE, *FOLDER.iterdir()} == {*made}, "write them anew: .venv/bin/python tests/docs/reference_page.py"
    differ = [path.name for path, text in made.items() if path.read_text() != text]
    assert not differ, "write them anew: .venv/bin/python tests/docs/reference_page.py"


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_stands_once(module: str) -> None:
    named = Counter(name for of, names in GROUPS.values() if of == module for name in names.split())
    assert named == Counter(public(importlib.import_module(module)))


def test_every_public_name_says_what_it_is_for(made: dict[Path, str]) -> None:
    silent = [line for line in made[PAGE].splitlines() if re.fullmatch(r" *- (\*\*)?`[^`]*`(\*\*)? *", line)]
    assert not silent
    empty = [
        heading
        for path, text in made.items()
        if path.suffix == ".md"
        for heading in re.findall(r"^###? (.+)\n+(?=##? |\Z)", text, re.MULTILINE)
    ]
    assert not empty
