# SPDX-License-Identifier: Apache-2.0
"""A system that listens in real time, and hosts that join it: processes of this machine."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from joining import LISTENER, Joining, free_endpoint

CERTIFICATES = Path(__file__).parent.parent / "remote" / "certificates"


@pytest.fixture
def endpoint() -> str:
    """Returns the endpoint of the test's system."""
    return free_endpoint()


@pytest.fixture
def listening(endpoint: str) -> Iterator[gpac.System]:
    """Yields a system in real time that listens as `cell-a`."""
    with gpac.System("line", progress=False) as cell:
        cell.listen(endpoint, LISTENER)
        yield cell


@pytest.fixture
def joins(endpoint: str) -> Iterator[Callable[..., Joining]]:
    """Yields `joins(name)`, which starts a host that joins the system; kills the remaining hosts at the end."""
    made: list[Joining] = []

    def join(name: str = "cell-b", *options: str, system: str = "line", at: str = endpoint) -> Joining:
        made.append(Joining(system, at, name, *options))
        return made[-1]

    yield join
    for joining in made:
        joining.kill()


@pytest.fixture
def certificates(tmp_path: Path) -> Path:
    """Returns the certificates of the tests, with keys that only their owner can read."""
    folder = tmp_path / "certificates"
    shutil.copytree(CERTIFICATES, folder)
    for key in ("server.key", "client.pem"):
        (folder / key).chmod(0o600)
    return folder
