# SPDX-License-Identifier: Apache-2.0
"""The page that follows the paper: each requirement once, each test and file that it names is there."""

from __future__ import annotations

import re
from collections import Counter

import pytest
from listings import ROOT

PAGE = (ROOT / "docs" / "paper.md").read_text()
_CELLS = [row.split("|") for row in re.findall(r"^\| \d+ \|.*$", PAGE, re.M)]
ROWS = {int(cells[1]): [cell.strip() for cell in cells[2:5]] for cells in _CELLS}
NOT_YET = {number for number, (_, where, _) in ROWS.items() if where.startswith("not done yet: ")}


def shown_by(number: int) -> list[str]:
    return re.findall(r"`(\w+)`", ROWS[number][2])


def names_of_tests() -> set[str]:
    """The tests of the whole tree: `def test_…` in Python, a function below `#[test]` in Rust, or in a list of checks."""
    python = {name for file in (ROOT / "tests").rglob("test_*.py") for name in re.findall(r"^def (test_\w+)\(", file.read_text(), re.M)}
    rust: set[str] = set()
    for file in (ROOT / "crates").rglob("*.rs"):
        text = file.read_text()
        rust |= set(re.findall(r"#\[test\]\s*(?:#\[[^\n]*\]\s*)*(?:///[^\n]*\s*)*fn (\w+)\(", text))
        for block in re.findall(r"^proptest! \{$.*?^\}$", text, re.M | re.S):
            rust |= set(re.findall(r"\bfn (\w+)\(", block))
        # The checks of every carrier: the macro makes a test of each that it lists.
        for listed in re.findall(r"\$crate::conformance! \{ \$on_each:([\w\s]*)\}", text):
            rust |= set(listed.split())
    return python | rust


def test_every_requirement_stands_once() -> None:
    numbers = Counter(int(number) for number in re.findall(r"^\| (\d+) \|", PAGE, re.M))
    assert numbers == Counter(range(1, 131))


def test_every_test_on_the_page_exists() -> None:
    known = names_of_tests()
    missing = {number: [test for test in shown_by(number) if test not in known] for number in ROWS}
    assert not {number: tests for number, tests in missing.items() if tests}


def test_every_conformance_test_is_on_the_page() -> None:
    numbered = {name for name in names_of_tests() if re.match(r"(test_)?r\d{3}_", name)}
    named = {test for number in ROWS for test in shown_by(number)}
    assert not numbered - named


@pytest.mark.parametrize("number", ROWS)
def test_what_is_done_has_a_test_and_a_place(number: int) -> None:
    _, where, _ = ROWS[number]
    if number in NOT_YET:
        assert not shown_by(number) and len(where) > len("not done yet: because")
    else:
        assert shown_by(number)
        assert any(found in where for found in ("`crates/", "`python/", "`examples/"))


def test_the_page_counts_right() -> None:
    partly = {number for number, (_, where, _) in ROWS.items() if "Not done yet: " in where}
    done = len(ROWS) - len(partly) - len(NOT_YET)
    assert f"{done} are done, {len(partly)} partly, {len(NOT_YET)} not yet." in PAGE
