# SPDX-License-Identifier: Apache-2.0
"""Fixtures for tests of programs: `cell` is a system under the virtual clock, closed at the end; `real_cell` runs in real time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from .system import System


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[System]:
    """A system of its own under the virtual clock."""
    from .system import System

    with System(request.node.name, clock="virtual") as made:
        yield made


@pytest.fixture
def real_cell(request: pytest.FixtureRequest) -> Iterator[System]:
    """A system of its own in real time."""
    from .system import System

    with System(request.node.name, progress=False) as made:
        yield made
