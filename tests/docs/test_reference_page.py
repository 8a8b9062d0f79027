# SPDX-License-Identifier: Apache-2.0
"""The page docs/reference.md has every public name, with its present signature and words."""

from __future__ import annotations

import importlib
import re
from collections import Counter

import pytest
from reference_page import GROUPS, MODULES, PAGE, page, public


def test_the_page_is_what_the_docstrings_say() -> None:
    assert PAGE.read_text() == page(), "write it anew: .venv/bin/python tests/docs/reference_page.py"


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_stands_once(module: str) -> None:
    named = Counter(name for of, names in GROUPS.values() if of == module for name in names.split())
    assert named == Counter(public(importlib.import_module(module)))


def test_every_public_name_says_what_it_is_for() -> None:
    silent = [line for line in page().splitlines() if re.fullmatch(r" *- (\*\*)?`[^`]*`(\*\*)? *", line)]
    assert not silent
