# SPDX-License-Identifier: Apache-2.0
"""docs/where.md names files that exist: a path ends like a file of the tree, and a bare name is a file near the path before it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).parent.parent.parent
FILE = re.compile(r"`([\w./-]+\.(?:rs|py|pyi|c|h|ts|tsx|css|toml|json|md))`")


def files() -> list[PurePosixPath]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [PurePosixPath(line) for line in listed.splitlines()]


def room(path: PurePosixPath) -> PurePosixPath:
    """Returns the crate or the folder of a package in which a file lies."""
    depth = 2 if path.parts[0] in ("crates", "python", "studio") else 1
    return PurePosixPath(*path.parts[:depth])


def missing(text: str, known: list[PurePosixPath]) -> list[str]:
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        rooms: set[PurePosixPath] = set()
        for name in FILE.findall(line):
            parts = PurePosixPath(name).parts
            matching = [path for path in known if path.parts[-len(parts) :] == parts]
            near = {room(path) for path in matching}
            if not matching or (len(parts) == 1 and rooms and not near & rooms):
                found.append(f"{number}: {name}")
            if len(parts) > 1:
                rooms = near
    return found


def test_each_file_exists() -> None:
    assert missing((ROOT / "docs/where.md").read_text(), files()) == []


def test_a_wrong_name_is_found() -> None:
    known = [PurePosixPath("crates/kernel/src/guard.rs"), PurePosixPath("crates/model/src/range.rs")]
    assert missing("| a | `kernel/src/guard.rs`, `range.rs` |", known) == ["1: range.rs"]
    assert missing("| a | `kernel/src/gard.rs` |", known) == ["1: kernel/src/gard.rs"]
