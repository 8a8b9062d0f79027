# SPDX-License-Identifier: Apache-2.0
"""A small system for tests, on each mapping; and the C blocks of `tests/blocks`, built once."""

from __future__ import annotations

import fcntl
import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
import user_mode_linux
from mappings.mapping import MAPPINGS
from opengpac import _native
from opengpac.system import open_systems
from rig import Rig

BLOCKS = Path(__file__).parent.parent / "blocks"

IN_VIRTUAL_TIME = ("virtual", "message")


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Returns the paths of the compiled C blocks, by file name; of several test processes in parallel the first compiles them."""
    side_by_side = "PYTEST_WORKER" in os.environ
    folder = tmp_path_factory.getbasetemp().parent / "blocks" if side_by_side else tmp_path_factory.mktemp("blocks")
    folder.mkdir(exist_ok=True)
    paths = {f.stem: str(folder / f"{f.stem}.so") for f in sorted(BLOCKS.glob("*.c"))}
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for stem, path in paths.items():
            if not Path(path).exists():
                _native.build([str(BLOCKS / f"{stem}.c")], path)
    return paths


_known: set[int] = set()
"""Identities of the systems that were open when the last test began, such as those of module fixtures."""


@pytest.fixture(autouse=True)
def _without_systems_of_earlier_tests() -> None:
    """Frees the systems that earlier tests left open. A system of the same name would otherwise be the same system, if the garbage
    collector has not run in between."""
    if not {id(system) for system in open_systems.systems()} <= _known:
        gc.collect()
        _known.clear()
        _known.update(id(system) for system in open_systems.systems())


@pytest.fixture(params=IN_VIRTUAL_TIME)
def cell(request: pytest.FixtureRequest) -> Iterator[gpac.System]:
    """Yields a system on each mapping of the virtual clock."""
    with MAPPINGS[request.param].open("cell") as made:
        yield made


@pytest.fixture
def rig(cell: gpac.System, built: dict[str, str]) -> Rig:
    """Returns a small system, on each mapping."""
    return Rig(cell, built)


@pytest.fixture
def memory_rig(built: dict[str, str]) -> Iterator[Rig]:
    """Yields a small system on the memory interconnect only, for tests that do not concern connections."""
    with gpac.System("cell", clock="virtual", seed=1) as made:
        yield Rig(made, built)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Prints, in a prominent place, the tests that this machine could not run."""
    if missing := user_mode_linux.missing():
        terminalreporter.section("not tried")
        terminalreporter.line(f"CANopen beside the package canopen, on a virtual bus: {missing}")
