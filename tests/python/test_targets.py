# SPDX-License-Identifier: Apache-2.0
"""No manifest excludes tests: the sources of a target with `test = false` contain none."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

CRATES = Path(__file__).parent.parent.parent / "crates"
MARKS = ("#[test]", "#[tokio::test", "proptest!")


def sources(crate: Path, target: dict[str, Any], of: str) -> list[Path]:
    """Returns the sources of a library, or those of a program that no library of the crate contains."""
    if of == "lib":
        return [*(crate / target.get("path", "src/lib.rs")).parent.rglob("*.rs")]
    return [crate / target.get("path", f"src/bin/{target['name']}.rs")]


def test_a_target_without_tests_has_none_in_its_sources() -> None:
    left_out, untested = [], 0
    for manifest in CRATES.glob("*/Cargo.toml"):
        crate, said = manifest.parent, tomllib.loads(manifest.read_text())
        for of, targets in (("lib", [said.get("lib", {})]), ("bin", said.get("bin", []))):
            for target in targets:
                if target.get("test", True):
                    continue
                untested += 1
                found = sources(crate, target, of)
                assert found and all(file.is_file() for file in found), f"{manifest}: {found}"
                left_out += [str(file) for file in found if any(mark in file.read_text() for mark in MARKS)]
    assert untested > 10 and not left_out, "take `test = false` out of the manifest of these"
