# SPDX-License-Identifier: Apache-2.0
"""Two axes for each test, homed or not."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import opengpac as gpac
from axes import machine
from opengpac.robots import Joint


@pytest.fixture
def axes() -> Iterator[gpac.Group[Joint]]:
    """Yields two axes, enabled."""
    with gpac.System("motion", clock="virtual", seed=1) as cell:
        yield machine(cell)


@pytest.fixture
def unhomed() -> Iterator[gpac.Group[Joint]]:
    """Yields two axes that need homing, enabled."""
    with gpac.System("motion", clock="virtual", seed=1) as cell:
        yield machine(cell, needs_home=True)
