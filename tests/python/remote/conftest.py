# SPDX-License-Identifier: Apache-2.0
"""Daemons with a Unix socket, and a small cell there that another program configured."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from daemons import Daemon


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    """Yields a daemon with the virtual clock."""
    made = Daemon(tmp_path)
    yield made
    made.stop()


@pytest.fixture
def real_daemon(tmp_path: Path) -> Iterator[Daemon]:
    """Yields a daemon in real time."""
    made = Daemon(tmp_path, "monotonic")
    yield made
    made.stop()


@pytest.fixture
def far(daemon: Daemon) -> Iterator[gpac.System]:
    """Yields a remote system, under the virtual clock, with a processor `rtp0` and its timer `fast` (1 ms)."""
    with gpac.connect(daemon.url, name="tests") as cell:
        cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        yield cell
