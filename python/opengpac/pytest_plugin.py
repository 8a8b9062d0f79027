# SPDX-License-Identifier: Apache-2.0
"""Fixtures for tests of programs: `cell` is a system under the virtual clock, `real_cell` one in real time; both are closed at the end
of the test. Tracebacks of refusals are cut at the test's own line."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from .system.system import System


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[Any]) -> None:
    """Cuts the traceback of a refusal at the test's own line, unless `--full-trace` or `OPENGPAC_TRACEBACK=full` is set."""
    from .errors import Error
    from .refusals.tracebacks import shorten

    if call.excinfo is not None and isinstance(call.excinfo.value, Error) and not item.config.option.fulltrace:
        shorten(call.excinfo.value)
        call.excinfo = pytest.ExceptionInfo.from_exception(call.excinfo.value)


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[System]:
    """Yields a new system under the virtual clock."""
    from .system.system import System

    with System(request.node.name, clock="virtual") as made:
        yield made


@pytest.fixture
def real_cell(request: pytest.FixtureRequest) -> Iterator[System]:
    """Yields a new system in real time."""
    from .system.system import System

    with System(request.node.name, progress=False) as made:
        yield made
