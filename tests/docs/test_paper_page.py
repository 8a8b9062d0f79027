# SPDX-License-Identifier: Apache-2.0
"""The page that follows the paper lists each requirement once, and each test that it names exists and runs."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from listings import ROOT
from named_tests import collected, files_of, not_run, python_tests, rust_tests, ways_out

PAGE = (ROOT / "docs" / "paper.md").read_text()
_CELLS = [row.split("|") for row in re.findall(r"^\| \d+ \|.*$", PAGE, re.M)]
ROWS = {int(cells[1]): [cell.strip() for cell in cells[2:5]] for cells in _CELLS}
NOT_YET = {number for number, (_, where, _) in ROWS.items() if where.startswith("not done yet: ")}


def shown_by(number: int) -> list[str]:
    return re.findall(r"`(\w+)`", ROWS[number][2])


PYTHON, RUST = python_tests(), rust_tests()
NAMED = {test for number in ROWS for test in shown_by(number)}


def number_of(test: str) -> int | None:
    """Returns the number of the requirement that a test names."""
    named = re.match(r"(?:test_)?r(\d{3})_", test)
    return int(named[1]) if named else None


def test_every_requirement_stands_once() -> None:
    numbers = Counter(int(number) for number in re.findall(r"^\| (\d+) \|", PAGE, re.M))
    assert numbers == Counter(range(1, 131))


def test_every_test_on_the_page_exists() -> None:
    assert not NAMED - PYTHON.keys() - RUST.keys()


def test_every_conformance_test_is_on_the_page() -> None:
    assert not {name for name in {*PYTHON, *RUST} if number_of(name)} - NAMED


def test_a_test_stands_where_its_name_says() -> None:
    elsewhere = {test: number for number in ROWS for test in shown_by(number) if number_of(test) not in (None, number)}
    assert not elsewhere, "the name of each of them has another number"
    assert not [number for number in ROWS.keys() - NOT_YET if not any(number_of(test) == number for test in shown_by(number))]


def test_every_python_test_on_the_page_runs() -> None:
    """Checks that each is collected with the options of the project, and that nothing in its file or above can keep it from running."""
    files = files_of(NAMED, PYTHON)
    assert not (NAMED & PYTHON.keys()) - collected(files)
    assert not {file.name: found for file in files if (found := ways_out(file))}


def test_every_rust_test_on_the_page_runs() -> None:
    """Checks that each is compiled by a target of the Makefile, and not ignored."""
    why_not = {name: [not_run(name, file) for file in RUST[name]] for name in NAMED & RUST.keys()}
    assert not {name: why for name, why in why_not.items() if all(why)}


def test_what_does_not_run_is_told(tmp_path: Path) -> None:
    """Tests the checks of this page themselves, on tests that do not run."""
    (tmp_path / "test_it.py").write_text("import pytest\n\n@pytest.mark.skip\ndef test_it(): ...\n")
    assert ways_out(tmp_path / "test_it.py") == ["test_it.py: mark.skip"]
    crate = tmp_path / "crate"
    (crate / "tests").mkdir(parents=True)
    (crate / "Cargo.toml").touch()
    for text, why in (
        ("#[test]\nfn it() {}", ""),
        ("#[test]\n#[ignore]\nfn it() {}", "it is ignored"),
        ('#![cfg(feature = "more")]\n#[test]\nfn it() {}', 'it is compiled with cfg(feature = "more") only'),
        ("#![cfg(loom)]\n#[test]\nfn it() {}", ""),
    ):
        (crate / "tests" / "it.rs").write_text(text)
        assert not_run("it", crate / "tests" / "it.rs") == why
    (crate / "src").mkdir()
    (crate / "src" / "lib.rs").write_text("mod other;\n")
    (crate / "src" / "it.rs").write_text("#[test]\nfn it() {}")
    assert not_run("it", crate / "src" / "it.rs") == "no file has `mod it;`"


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
