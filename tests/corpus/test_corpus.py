# SPDX-License-Identifier: Apache-2.0
"""The fault corpus: small programs, each with a fault, and the expected output of `opengpac check`.

The expected text is beside the program as `NAME.expected`; `pytest tests/corpus --renew` rewrites it, to be reviewed before it is
committed.
"""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from opengpac import cli

HERE = Path(__file__).parent
PROGRAMS = sorted((HERE / "programs").rglob("*.py"))


def said(program: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[int, str]:
    """Returns exit code and output of `opengpac check` for a program, run in the program's folder, whose path is cut out of the text."""
    monkeypatch.chdir(program.parent)
    monkeypatch.syspath_prepend(str(program.parent))
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = cli.main(["check", program.name])
    return code, (err.getvalue() + out.getvalue()).replace(f"{program.parent}/", "")


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_a_fault_is_named_before_anything_runs(program: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    code, text = said(program, monkeypatch)
    expected = program.with_suffix(".expected")
    if request.config.getoption("--renew"):
        expected.write_text(text)
    assert text == expected.read_text()
    assert code == 1, "a fault is an exit code of 1"


def test_the_corpus_is_whole() -> None:
    assert len(PROGRAMS) >= 60
    kinds = {p.with_suffix(".expected").read_text().split("\n", 1)[0].split(": ", 1)[-1] for p in PROGRAMS}
    assert len(kinds) >= 60, "each program has a fault of its own"
