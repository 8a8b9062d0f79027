# SPDX-License-Identifier: Apache-2.0
"""CHANGELOG.md has areas, each with the added, changed and fixed, and a short line for each change."""

from __future__ import annotations

import re

from listings import ROOT

LONGEST = 160


def areas() -> dict[str, str]:
    """Returns the areas of the newest release: title → text. Entries before the first area are not assigned yet."""
    newest = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)[1]
    found = re.split(r"^### (.+)\n", newest, flags=re.MULTILINE)
    return dict(zip(found[1::2], found[2::2], strict=True))


def test_area_has_what_was_added_changed_and_fixed() -> None:
    assert areas()
    for area, text in areas().items():
        kinds = re.findall(r"^#### (.+)$", text, re.MULTILINE)
        assert kinds and [kind for kind in ("Added", "Changed", "Fixed") if kind in kinds] == kinds, area


def test_change_is_a_short_line() -> None:
    lines = [line for text in areas().values() for line in text.splitlines() if line and not line.startswith("####")]
    assert not [line for line in lines if not line.startswith("- ") or len(line) > LONGEST]
