# SPDX-License-Identifier: Apache-2.0
"""The index of the decisions has a line for each file, with its title and date, under a subject."""

from __future__ import annotations

import re

from listings import ROOT

FOLDER = ROOT / "docs" / "decisions"
INDEX = FOLDER / "README.md"
_LINE = re.compile(r"^- \[(.+)\]\(((\d{3})-[\w-]+\.md)\) \((\d{4}-\d\d-\d\d)\)$", re.MULTILINE)


def test_index_has_a_line_for_each_decision() -> None:
    files = sorted(path.name for path in FOLDER.glob("[0-9]*.md"))
    assert sorted(file for _, file, _, _ in _LINE.findall(INDEX.read_text())) == files
    assert len({file[:3] for file in files}) == len(files), "no number stands for two decisions"


def test_line_of_a_decision_has_its_title_and_date() -> None:
    for title, file, _, date in _LINE.findall(INDEX.read_text()):
        head, _, day = (FOLDER / file).read_text().splitlines()[:3]
        assert (f"# {title}", date) == (head, day), file


def test_lines_stand_under_a_subject() -> None:
    before, *subjects = INDEX.read_text().split("\n## ")
    assert not _LINE.findall(before)
    assert all(_LINE.findall(subject) for subject in subjects)
