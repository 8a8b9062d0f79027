# SPDX-License-Identifier: Apache-2.0
"""A system in real time with one processor here and one in a process of its own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import opengpac as gpac
from afar import Afar


@pytest.fixture
def afar(built: dict[str, str]) -> Iterator[Afar]:
    """Yields `rtp0` here and `rtp1` in a process of its own, each with `fast`, a timer of 2 ms."""
    with gpac.System("afar", progress=False) as cell:
        yield Afar(cell, built)
