# SPDX-License-Identifier: Apache-2.0
"""`make test-fast`: the tests that it runs for a change exist, and every changed crate is included."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parent.parent.parent


@pytest.fixture(scope="module")
def fast() -> ModuleType:
    """Returns `tests/fast.py` as a module."""
    spec = importlib.util.spec_from_file_location("fast", ROOT / "tests" / "fast.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_what_stands_on_a_crate_exists(fast: ModuleType) -> None:
    assert not [crate for crate in fast.STANDS_ON if not (ROOT / "crates" / crate / "Cargo.toml").is_file()]
    assert not [path for paths in fast.STANDS_ON.values() for path in paths if not (ROOT / path).exists()]


def test_a_crate_that_changed_is_checked_and_tested(fast: ModuleType) -> None:
    files = ["crates/supervisor/src/core.rs", "crates/block-derive/src/lib.rs", "crates/gone/src/lib.rs", "docs/verbs.md"]
    crates = fast.crates_of(files)
    assert crates == ["block-derive", "supervisor"]
    commands = fast.commands(crates, files)
    for begin in (["python", "tests/lints.py", "cargo"], ["cargo", "test"]):
        (words,) = [words for words in commands if words[: len(begin)] == begin]
        assert {"supervisor", "opengpac-derive"} <= set(words)
    assert ["pytest", "-q", "tests/python/cell"] in commands and any("tests/python/conformance" in words for words in commands)


def test_a_page_needs_no_compiler(fast: ModuleType) -> None:
    assert [words[0] for words in fast.commands([], ["studio/src/shell/App.tsx"])] == ["cargo", "ruff", "npm"]
