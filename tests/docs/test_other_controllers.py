# SPDX-License-Identifier: Apache-2.0
"""The table of docs/motion.md for users of other controllers: the names in its last column exist, and features that it declares missing
are missing."""

from __future__ import annotations

import operator
import re
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import motion

PAGE = Path(__file__).parent.parent.parent / "docs" / "motion.md"
SPAN = re.compile(r"`([^`]+)`")
NAMES = ("MC_Power", "MoveJ", "PTP", "movej", "MC_MoveCircularAbsolute", "mcBlending")


def rows() -> list[list[str]]:
    """Returns the rows of the table, cell by cell."""
    lines = PAGE.read_text().partition("## By the names of other controllers")[2].strip().splitlines()
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return table[2:]


def test_the_table_is_whole() -> None:
    assert len(rows()) > 25 and all(len(row) == 5 and row[-1] for row in rows())
    text = str(rows())
    assert all(name in text for name in NAMES)


@pytest.fixture(scope="module")
def known() -> dict[str, object]:
    """Returns the first components of the names in the last column."""
    arm = gpac.robots.load("ur5e", clock="virtual").enable()
    moving = motion.move_relative.asynch(arm["wrist_3"], 0.1)
    device = arm.system.physical_devices["ur5e"]
    named = {"gpac": gpac, "arm": arm, "vi": moving, "cell": arm.system, "device": device, "motion": motion, "moves": arm.queue()}
    try:
        return named
    finally:
        moving.halt()


@pytest.mark.parametrize("row", rows(), ids=lambda row: f"{row[0]} {row[1]}")
def test_what_the_last_column_names_is_there(known: dict[str, object], row: list[str]) -> None:
    said = row[-1]
    for span in SPAN.findall(said):
        if span.startswith("arbitration="):
            assert span.split('"')[1] in ("abort", "queue")
            continue
        if ">>" in span or "=" in span.replace("override = 0", ""):
            continue
        name = span.partition("(")[0].partition(" ")[0]
        root, _, rest = name.partition(".")
        if root in known:
            operator.attrgetter(rest)(known[root])
        else:
            is_there = any(hasattr(place, name) for place in (motion, gpac.cell, gpac.library, gpac))
            assert is_there or name in motion.follow.signature.parameters, f"{name} of '{said}'"
    if said.startswith("not there"):
        own = re.findall(r"MC_(\w+)", row[0])
        assert not any(hasattr(motion, re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()) for name in own)
