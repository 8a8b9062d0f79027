# SPDX-License-Identifier: Apache-2.0
"""The suite runs on every mapping. Tests that advance time themselves run under the virtual clock; all others run in real time, too."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import opengpac as gpac
from mappings.mapping import MAPPINGS
from mappings.suite import mappings_of
from rig import Rig


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "cell" in metafunc.fixturenames:
        metafunc.parametrize("cell", mappings_of(metafunc.function), indirect=True)


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[gpac.System]:
    """Yields a system on each mapping on which the test can run."""
    with MAPPINGS[request.param].open("cell") as made:
        yield made


@pytest.fixture
def threads(built: dict[str, str]) -> Iterator[Rig]:
    """Yields a small system in real time whose processors are threads: blocks of one module can see each other there without OpenGPAC."""
    with MAPPINGS["threads"].open("cell") as made:
        yield Rig(made, built)


@pytest.fixture(params=["threads", "processes"])
def real(request: pytest.FixtureRequest, built: dict[str, str]) -> Iterator[Rig]:
    """Yields a small system in real time, on threads and on processes."""
    with MAPPINGS[request.param].open("cell") as made:
        yield Rig(made, built)
