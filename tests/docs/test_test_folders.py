# SPDX-License-Identifier: Apache-2.0
"""tests/README.md has a line for each folder of tests."""

from __future__ import annotations

import re
from pathlib import Path

from listings import ROOT


def folders() -> set[str]:
    """Returns the folders that contain Python tests."""
    found = {path.parent.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py")}
    return {path.as_posix() for path in found}


def test_each_folder_has_a_line() -> None:
    text = (ROOT / "tests" / "README.md").read_text()
    named = set[str]()
    for row in re.findall(r"^\| (`.*?`.*?) \|", text, re.MULTILINE):
        first, *others = re.findall(r"`([\w/.]+)`", row) or [""]
        named |= {first, *(f"{Path(first).parent.as_posix()}/{other}" for other in others), *others}
    assert folders() - named == set()
    missing = {
        name for name in named if name.startswith(("tests/", "crates/", "studio/")) and "NAME" not in name and not (ROOT / name).exists()
    }
    assert not {name for name in missing if name.count("/") == 1}
