# SPDX-License-Identifier: Apache-2.0
"""Tests of the whole tree by name: the file of each, and whether it runs when everything is tested."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

from listings import ROOT

MAKEFILE = (ROOT / "Makefile").read_text()
WAYS_OUT = re.compile(r"pytest\.(?:skip|xfail|importorskip)|mark\.(?:skip|skipif|xfail)|pytest_collection_modifyitems")
"""Constructs by which a Python test is collected yet not run, or removed after collection."""
REGISTERED = ROOT / "crates" / "library" / "src" / "blocks"
"""Folder each of whose files the library's build script makes a module."""
RUN_ALONE = {"loom": "--cfg loom", "rtsan": "--cfg rtsan"}
"""Rust configurations that have a target of the Makefile, and the words in it."""


def python_tests() -> dict[str, list[Path]]:
    """Returns the test functions that pytest collects: name → files."""
    found = defaultdict(list)
    for file in (ROOT / "tests").rglob("test_*.py"):
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                found[node.name].append(file)
    return dict(found)


def rust_tests() -> dict[str, list[Path]]:
    """Returns the functions below `#[test]`, in a `proptest!`, or in a list of checks of every carrier: name → files."""
    found = defaultdict(list)
    for file in (ROOT / "crates").rglob("*.rs"):
        text = file.read_text()
        names = re.findall(r"#\[test\]\s*(?:#\[[^\n]*\]\s*)*(?:///[^\n]*\s*)*fn (\w+)\(", text)
        for block in re.findall(r"^proptest! \{$.*?^\}$", text, re.M | re.S):
            names += re.findall(r"\bfn (\w+)\(", block)
        # The macro makes a test of each name in its list.
        for listed in re.findall(r"\$crate::conformance! \{ \$on_each:([\w\s]*)\}", text):
            names += listed.split()
        for name in names:
            found[name].append(file)
    return dict(found)


def collected(files: Iterable[Path]) -> set[str]:
    """Returns the names of the tests that pytest collects from these files, with the options of the project."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *sorted(map(str, {*files}))]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return set(re.findall(r"::(test_\w+)", done.stdout))


def ways_out(file: Path) -> list[str]:
    """Returns the constructs in a Python file, or in the configuration above it, that may keep a test from running."""
    above = [folder / "conftest.py" for folder in file.parents if ROOT in (folder, *folder.parents)]
    return [f"{of.name}: {word}" for of in (file, *above) if of.exists() for word in WAYS_OUT.findall(of.read_text())]


def not_run(name: str, file: Path) -> str:
    """Returns why a Rust test does not run; empty if it does."""
    text = file.read_text()
    if re.search(rf"#\[ignore[^\n]*\]\s*(?:#\[[^\n]*\]\s*)*fn {name}\(|#\[test\]\s*#\[ignore[^\n]*\]\s*fn {name}\(", text):
        return "it is ignored"
    for condition in re.findall(r"^#!\[cfg\((.*)\)\]$", text, re.M):
        if condition.startswith("not(") or RUN_ALONE.get(condition, "no target") in MAKEFILE:
            continue
        return f"it is compiled with cfg({condition}) only"
    return "" if _reached(file) else f"no file has `mod {file.stem};`"


def _reached(file: Path) -> bool:
    """Returns whether a file is compiled: the root of a crate or of a test, or a module of a compiled file."""
    if REGISTERED in file.parents:
        return True
    if file.name in ("lib.rs", "main.rs", "build.rs") or (file.parent.name == "tests" and (file.parent.parent / "Cargo.toml").exists()):
        return True
    name = file.parent.name if file.name == "mod.rs" else file.stem
    folder = file.parent.parent if file.name == "mod.rs" else file.parent
    parents = [*(folder / root for root in ("lib.rs", "main.rs", "mod.rs")), folder.with_suffix(".rs")]
    declared = re.compile(rf"^\s*(?:pub(?:\(crate\))? )?mod {name};|#\[path = \"[^\"]*{file.name}\"\]", re.M)
    return any(parent.exists() and declared.search(parent.read_text()) and _reached(parent) for parent in parents)


def files_of(names: Iterable[str], tests: Mapping[str, list[Path]]) -> set[Path]:
    """Returns the files that contain the named tests."""
    return {file for name in names for file in tests.get(name, [])}
