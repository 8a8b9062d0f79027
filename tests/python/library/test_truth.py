# SPDX-License-Identifier: Apache-2.0
"""The library describes itself correctly: files, documentation, units, faults, examples."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
from opengpac import library as lib
from opengpac.library.catalogue import Catalogue
from opengpac.library.components import Component
from opengpac.library.examples import example

ROOT = Path(__file__).parent.parent.parent.parent
FILES = {file.stem: file for file in (ROOT / "crates" / "library" / "src" / "blocks").rglob("*.rs")}
BLOCKS = sorted(lib.blocks())
FOLLOWER = ROOT / "crates/library/src/kinematics/follower.rs"
"""Common part of the generators of tool motion, with its refusals."""
SHARED_FAULTS = dict(
    re.findall(r"^pub const (\w+): u32 = (\d+);$", (ROOT / "crates/library/src/kinematics/mod.rs").read_text(), re.MULTILINE)
)


def test_every_file_is_a_block_and_every_block_a_file() -> None:
    assert sorted(FILES) == BLOCKS


def test_the_folder_of_a_block_is_its_category(database: Catalogue) -> None:
    for component in lib.list():
        if component.kind == "block":
            folder = FILES[component.name].parent.name
            assert component.category == (folder if folder != "blocks" else "motion")


def test_no_name_of_a_block_is_taken_by_the_library_itself(database: Catalogue) -> None:
    assert not {*BLOCKS} & {*lib.__all__, "components", "catalogue", "origins", "examples", "manuals", "searching", "padding"}


@pytest.mark.parametrize("name", BLOCKS)
def test_the_documentation_of_a_block_is_whole(name: str) -> None:
    block = lib.block(name)
    first = block.doc.splitlines()[0]
    assert "=" in first or "|" in first, "the first sentence has the equation"
    assert first.endswith(".") and not first.endswith("..."), first
    for item in block.items.values():
        assert item.doc and not item.doc.endswith(".") and not item.doc[0].isspace(), item


@pytest.mark.parametrize("name", BLOCKS)
def test_every_fault_of_a_block_is_documented(name: str) -> None:
    source = FILES[name].read_text()
    # A block declared for tables of two lengths has its body in a macro beside the declarations.
    for module in re.findall(r"^use crate::(\S+::(?:planner|generator))::", source, re.MULTILINE):
        source += (ROOT / "crates/library/src" / f"{module.replace('::', '/')}.rs").read_text()
    codes = {code for _, code in re.findall(r"^(?:pub\(crate\) )?const (\w+): u32 = (\d+);$", source, re.MULTILINE)}
    # A refusal common to several kinematic blocks has the same code in all of them.
    if FILES[name].parent.name == "kinematics":
        follower = FOLLOWER.read_text() if "kinematics::follower" in source else ""
        refused = rf"\b(?:Fault|Err|ok_or)\(({'|'.join(SHARED_FAULTS)})\)"
        codes |= {SHARED_FAULTS[fault] for fault in re.findall(refused, source + follower)}
    said = set(re.findall(r"(?:[Ff]aults?:? |; )(\d+)\b", lib.block(name).doc))
    assert codes == said


def test_every_unit_is_one(database: Catalogue) -> None:
    with gpac.System("units", clock="virtual") as cell:
        declared = {item.unit for name in BLOCKS for item in lib.block(name).items.values() if item.unit}
        units = {unit for choice in declared for unit in choice.split("|")}
        assert {"rad", "s", "Hz"} <= units
        for number, unit in enumerate(sorted(units)):
            svv = cell.svv(f"u{number}", "double", unit=unit)
            svv.value = f"2 {unit}"
            assert svv.value == 2.0


@pytest.mark.parametrize("name", BLOCKS)
def test_a_manual_names_everything_and_its_example_runs(name: str) -> None:
    manual = lib.show(name)
    block = lib.block(name)
    for item in block.items.values():
        assert (f"\n  {item.name} " in manual) == (item.kind != "state"), item
    component = Component(name, "block", "", "library", block.doc, block)
    lines = example(component)
    assert "\n".join(["to try it", *(f"  {line}" for line in lines)]) in manual
    names = {"gpac": gpac, "lib": lib, "np": np}
    for line in lines[:-1]:
        exec(line, names)
    trial = eval(lines[-1], names)
    assert trial.fault is None and trial.outputs, trial


def test_a_long_default_is_cut() -> None:
    chain = next(line for line in lib.show("jacobian").splitlines() if line.lstrip().startswith("chain"))
    assert "…" in chain and len(chain) <= 140
