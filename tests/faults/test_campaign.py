# SPDX-License-Identifier: Apache-2.0
"""A few faults of each kind; `make faults` makes hundreds. The accounting finds faults that leave something behind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from campaign import built, rounds_of
from kinds import KINDS
from leftovers import Before

# Leftovers are searched for on the whole machine.
pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def blocks(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Returns the module of failing blocks."""
    return built(str(tmp_path_factory.mktemp("faults")))


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name.replace(" ", "_"))
def test_everything_holds_after_a_fault(kind, blocks: str) -> None:
    assert not [wrong for one in rounds_of(kind, kind.bounded, 1, blocks) for wrong in one.wrong]


def test_the_accounting_finds_what_is_left() -> None:
    before, shared = Before(), Path("/dev/shm/opengpac_left_by_a_test")
    program = [sys.executable, "-c", "print(flush=True); input()"]
    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        shared.touch()
        try:
            # Before the child runs its own code, its environment, by which it is recognised, may not exist yet.
            assert child.stdout is not None and child.stdout.readline() == b"\n"
            left = before.left_over(within_s=0)
        finally:
            shared.unlink()
            child.communicate(b"\n")
    assert any(f"process {child.pid}" in line for line in left) and f"shared memory {shared}" in left
    assert not [line for line in before.left_over() if str(child.pid) in line or str(shared) in line]
